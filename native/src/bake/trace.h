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

// Of patches whose light is not shown; none where the settings have none.
Clusters clustersOf(const Scene& scene, const Patches& patches, const Settings& settings);

// Patches and traced lines, which stay valid as long as the geometry does, and what later bakes
// with them can go on with.
struct Trace {
    Trace(uint64_t hash, uint64_t likeness, Patches made, const Scene& scene,
          const Settings& settings);

    // When the patches are as they stay: from here on lines are traced.
    void startLines(const Settings& settings);

    // Of lines as the settings have them, and of those that see all surfaces: by lists of pixels
    // also where a bundle is one line.
    ProjectorInput projectorInput(const Settings& settings) const;
    ProjectorInput exactInput(const Settings& settings) const;

    const Visibility& visibilityOfLights() const {
        return directVisibility ? *directVisibility : visibility;
    }

    // Whether all traced lines are in the counts: not after a cancel on the way, and not where a
    // transport uses lines without counting them.
    bool isWhole() const { return tracer && tracer->bundleCount() == counts.bundles; }

    // Measures the exposed share where the lines that were traced tell it to be a part.
    void measureExposedShare(uint32_t seed);

    // What lines of exact projection meet, with the same measured.
    Surroundings surroundingsOf(const Settings& settings) const;

    // Whether it is of a scene with these hashes.
    bool isOf(uint64_t geometry, uint64_t alike) const {
        return hash == geometry && (likeness == alike || !patches.anyCoincide);
    }

    // Per side: the share that nothing covers.
    std::vector<float> exposedShare() const {
        return surrounding.exposed.empty() ? clusters.spread(counts.exposedShare())
                                           : surrounding.exposed;
    }

    // Per side: the lines that have met it, however dense they are, not where it is covered; and
    // those of each half.
    std::vector<float> linesMet() const;
    std::vector<std::array<float, 2>> linesByHalf() const;
    double linesMetByAll() const;  // of all sides

    LineSolutions& solutionsOf(int32_t lightSet) {
        return solutions.try_emplace(lightSet, counts.sideCount()).first->second;
    }

    // Through the bounding sphere.
    double linesPerBundle() const;

    const uint64_t hash;      // geometryHash
    const uint64_t likeness;  // likenessHash
    Patches patches;
    Clusters clusters;  // of the patches, between which light is exchanged
    const Visibility visibility;
    std::unique_ptr<const Visibility> directVisibility;  // where other surfaces stop direct light
    Surroundings surrounding;                            // empty: as the counts have it
    LineDensity density{};
    std::vector<Report::Cut> cuts;
    size_t uncutGaps = 0;  // patches beside narrow gaps that the solver does not have cut
    LineCounts counts;     // per side of the clusters
    std::unique_ptr<BundleTracer> tracer;
    Looks looks;  // at the light along its lines

    struct Shot {
        std::optional<uint64_t> hash;  // lightHash; none: there is no shot
        uint64_t aims = 0;             // shotHash
        FirstShot shot;
    };
    std::map<int32_t, Shot> shots;               // the last GATHER of each light set
    std::map<int32_t, LineSolutions> solutions;  // of each light set, between the clusters
};

// What every stage of a bake works on.
struct StageInput {
    const Scene& scene;
    const Settings& settings;
    const Progress& progress;
    Trace& trace;
};

}  // namespace raybundle
