// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "bundles/bundle_tracer.h"
#include "bundles/line_counts.h"
#include "bundles/line_windows.h"
#include "first_shot/first_shot.h"
#include "first_shot/stand_ins.h"
#include "job/progress.h"
#include "job/report.h"
#include "job/settings.h"
#include "patches/clusters.h"
#include "patches/patches.h"
#include "scene/scene.h"
#include "stated_error/noise.h"
#include "transport/transport.h"
#include "visibility/visibility.h"

namespace raybundle {

// Returns the clusters of the patches whose light is not shown. The result has no clusters if the
// settings exclude them.
Clusters clustersOf(const Scene& scene, const Patches& patches, const Settings& settings);

// Patches and traced lines, which stay valid while the geometry is unchanged, and results from
// which later bakes with these lines start.
struct Trace {
    // `hash` is the geometryHash of the scene, `likeness` its likenessHash, `made` its patches.
    Trace(uint64_t hash, uint64_t likeness, Patches made, const Scene& scene,
          const Settings& settings);

    // Prepares the tracing of lines. Call this once, when all cuts of the patches have been made.
    void startLines(const Settings& settings);

    // Return the input of a projector: projectorInput() for lines as the settings ask for,
    // exactInput() for lines that meet all surfaces. The latter have a pixel size even if the
    // settings ask for bundles of a single line.
    ProjectorInput projectorInput(const Settings& settings) const;
    ProjectorInput exactInput(const Settings& settings) const;

    // Returns the visibility for the light of the sources.
    const Visibility& visibilityOfLights() const {
        return directVisibility ? *directVisibility : visibility;
    }

    // Returns whether the counts contain all traced lines. They do not after a cancellation in the
    // middle of tracing, and not if the transport uses lines without counting them.
    bool isWhole() const { return tracer && tracer->bundleCount() == counts.bundles; }

    // Measures the exposed share of the sides that are partly covered according to the lines traced
    // so far. Does nothing if `surrounding` is known, or no line was traced since the last call.
    void measureExposedShare(uint32_t seed);

    // Returns the surroundings of all sides, found by lines of exact projection. The exposed share
    // of sides that are partly covered is measured as in measureExposedShare().
    Surroundings surroundingsOf(const Settings& settings) const;

    // Returns whether this trace belongs to a scene with these hashes. `alike` is its likenessHash,
    // which matters only if faces coincide.
    bool isOf(uint64_t geometry, uint64_t alike) const {
        return hash == geometry && (likeness == alike || !patches.anyCoincide);
    }

    // Returns per side the share of its area that no other surface covers, 0 to 1.
    std::vector<float> exposedShare() const {
        return surrounding.exposed.empty() ? clusters.spread(counts.exposedShare())
                                           : surrounding.exposed;
    }

    // Return per side the number of lines that have met its exposed part: linesMet() in all,
    // linesByHalf() for each half of the bundles. Each line counts once, whatever its density.
    std::vector<float> linesMet() const;
    std::vector<std::array<float, 2>> linesByHalf() const;
    double linesMetByAll() const;  // sum over all sides of the clusters

    // Returns the solutions of a light set, from which solves start. Creates empty ones at the
    // first call.
    LineSolutions& solutionsOf(int32_t lightSet) {
        return solutions.try_emplace(lightSet, counts.sideCount()).first->second;
    }

    // Returns the stand-ins for these shown sides (null: all sides are shown): those of the last
    // call if `aims`, the result of shotHash(), is equal. The reference is valid until the next
    // call.
    const StandIns& standInsFor(const std::vector<bool>* isShown, uint64_t aims);

    // Returns the number of lines of a bundle through the bounding sphere of the scene, outside of
    // windows.
    double linesPerBundle() const;

    const uint64_t hash;      // geometryHash
    const uint64_t likeness;  // likenessHash
    Patches patches;
    Clusters clusters;  // clusters of the patches, between which light is exchanged
    const Visibility visibility;
    // Visibility for the light of the sources, if some instances block this light but do not
    // exchange light, or the reverse. Null: `visibility` is used.
    std::unique_ptr<const Visibility> directVisibility;
    Surroundings surrounding;  // empty: `counts` has the exposed share
    LineDensity density{};
    std::vector<Report::Cut> cuts;
    size_t uncutGaps = 0;      // patches beside narrow gaps that are not cut with this solver
    LineCounts counts;         // per side of the clusters
    uint32_t exposedFrom = 0;  // number of bundles at the last measureExposedShare()
    std::unique_ptr<BundleTracer> tracer;
    Looks looks;  // looks at the noise along these lines, by earlier bakes

    // The first shot GATHER of a light set.
    struct Shot {
        std::optional<uint64_t> hash;  // lightHash; empty: there is no shot
        uint64_t aims = 0;             // shotHash
        FirstShot shot;
    };
    std::map<int32_t, Shot> shots;               // the last GATHER of each light set
    std::map<int32_t, LineSolutions> solutions;  // of each light set, per side of the clusters

    struct AimedStandIns {
        uint64_t aims;  // shotHash
        StandIns standIns;
    };
    std::optional<AimedStandIns> standIns;  // of the last bake; empty before the first one
};

class Interim;

// The input of every stage of a bake. All references must outlive it.
struct StageInput {
    const Scene& scene;
    const Settings& settings;
    const Progress& progress;
    Trace& trace;
    Interim* interim;  // receives light and noise while the bake runs; null: nobody looks
};

}  // namespace raybundle
