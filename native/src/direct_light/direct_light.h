// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light straight from the sources, seen from receivers: patch sides, or points on them. Each
// gathers the light of each source with stratified shadow rays; where the source has a closed form
// without occluders, the rays only estimate the share that is visible, so that fully lit and fully
// dark receivers have no noise.
//
// Sources: Szecsi, Sbert and Szirmay-Kalos, "Combined Correlated and Importance Sampling in Direct
// Light Source Computation" (2004) for the closed form as a control.
// Differs:
// - Emission that bundles carry without much noise is no source here
//   (direct_light/emission_split.h).
// - Each light set has a DirectLight of its own, which knows nothing of the others: its light is
//   what a scene with no other lights would have, sample for sample.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "direct_light/emission_split.h"
#include "direct_light/light_by_source.h"
#include "direct_light/outlook.h"
#include "job/skips.h"
#include "lights/light_source.h"
#include "lights/receiver.h"
#include "patches/patches.h"
#include "sampling/sobol.h"
#include "scene/scene.h"
#include "visibility/visibility.h"

namespace raybundle {

// The light of few samples at each receiver.
struct CoarseShot {
    std::vector<Gathered> gathered;
    std::vector<bool> seen;  // per source: whether any receiver got its light
    double bundled = 0;      // about the irradiance that emission left to the bundles makes, W/m^2
};

struct ReceiverPlace;

class DirectLight {
  public:
    // The light of a set, or what belongs to none. Everything passed must outlive the object.
    DirectLight(const Scene& scene, const Patches& patches, const Visibility& visibility,
                uint32_t seed, int32_t lightSet = kNoLightSet, const Skips& skips = {});

    // The light of surfaces that shine by what they reflect: of the sides that are sources in
    // `reflected`.
    DirectLight(const Scene& scene, const Patches& patches, const Visibility& visibility,
                uint32_t seed, const Skips& skips, EmissionSplit reflected);

    // Per side: all emission of the set, W/m^2.
    const std::vector<glm::vec3>& emission() const { return split->emitted; }
    // Of emission that is left out, for nobody ever sees it: sides, and power, W.
    size_t unseenSides() const { return split->unseen; }
    const glm::dvec3& unseenPower() const { return split->unseenPower; }

    // Per side: emission that is no source here, for the bundles to carry, W/m^2.
    const std::vector<glm::vec3>& bundledEmission() const { return split->bundled; }
    const std::vector<std::unique_ptr<LightSource>>& lightSources() const { return sources; }

    // Gathers at `count` receivers to about `targetError` relative standard error each: all
    // coarsely first, then those again whose error is too large beside the mean light.
    // Of a source that surrounds them (direct_light/outlook.h) they then sample what is seen there.
    // `progress` gets the share that is done. coarse: what is known of all receivers, or empty.
    // neighbours: of receivers that have any half as many samples do at first, and those whose
    // neighbours disagree with them about a shadow take more. bySource: gets what came from each
    // source; null, or of `count` receivers, all of which are gathered here.
    std::vector<Gathered> gather(size_t count, const std::function<Receiver(size_t)>& receiverAt,
                                 float targetError, const std::function<void(double)>& progress,
                                 CoarseShot coarse = {},
                                 const std::vector<ReceiverPair>& neighbours = {},
                                 LightBySource* bySource = nullptr) const;

    // The same by what each source gave with other strengths: only the receivers whose error is too
    // large beside the light as it is now gather again. matches: of `before` with these sources.
    std::vector<Gathered> scale(const LightBySource& before,
                                const std::vector<LightBySource::Match>& matches,
                                const std::function<Receiver(size_t)>& receiverAt,
                                float targetError,
                                const std::function<void(double)>& progress) const;

    // The first, coarse pass of that, to begin with: gathers at `these` receivers. neighbours: as
    // above. sightings: per receiver, to be filled; or null.
    void shootCoarsely(CoarseShot& coarse, const std::vector<uint32_t>& these,
                       const std::function<Receiver(size_t)>& receiverAt,
                       const std::function<void(double)>& progress,
                       const std::vector<ReceiverPair>& neighbours = {},
                       LightBySource* bySource = nullptr,
                       std::vector<Sightings>* sightings = nullptr) const;

    // An unbiased estimate at a point by one sample of each source, W/m^2; index: of the sample.
    glm::vec3 sample(const Receiver& receiver, uint32_t index) const;

    // What `count` points on a patch side get without occluders, W/m^2: of a source so far away
    // that it changes by less than a share `even` over the patch, that at its middle.
    void unblocked(uint32_t side, const glm::vec3* points, size_t count, float even,
                   glm::vec3* light) const;

    // Whether lines that end at the first surface leave out some of the light of a side's sources.
    bool hasPassingLight(uint32_t side) const;

    // Of each source; 0 where it has no power.
    std::vector<PowerShares> powerShares() const;

  private:
    class SourceGather;
    // Without sources.
    DirectLight(const Scene& scene, const Patches& patches, const Visibility& visibility,
                uint32_t seed, const Skips& skips, std::unique_ptr<const EmissionSplit> split);

    using Seen = std::vector<std::atomic<bool>>;  // per source: whether any receiver got its light

    void gatherThese(std::vector<Gathered>& results, const Aims& these,
                     const std::function<Receiver(size_t)>& receiverAt, Seen& seen,
                     const std::function<void(double)>& progress, LightBySource* bySource,
                     std::vector<Sightings>* sightings) const;
    // parts: per source, to be filled; or null. sightings: likewise, of the source with parts.
    Gathered gather(const Receiver& receiver, const Aim& aim, Seen& seen, LightPart* parts,
                    Sightings* sightings) const;
    // Counts what it does in `sum`.
    LightPart gatherFrom(size_t source, const Receiver& receiver, const ReceiverPlace& place,
                         const Aim& aim, Seen& seen, Sightings* sightings, Gathered& sum) const;
    // Whether the light that a side gets from a source comes on top of the source's power.
    bool isUnpowered(size_t source, uint32_t side) const;
    const LightSource* surrounding() const;  // the source that has parts, if there is one
    // Gives the aims of receivers that see little of it their outlooks, which are returned: from
    // the sightings of all of them, and then from samples by these. Counts the rays in `results`.
    std::array<Outlooks, 2> lookAround(Aims& further, std::vector<Gathered>& results,
                                       const std::function<Receiver(size_t)>& receiverAt,
                                       std::vector<Sightings> sightings) const;
    void look(const LightSource& source, const Receiver& receiver, const Outlook& outlook,
              Sightings& sightings, Gathered& sum) const;
    std::vector<float> unblockedWeights(const ReceiverPlace& place) const;
    bool isOutOfSight(const LightSource& source, const ReceiverPlace& place) const;
    // By a side and the means of the angleTerms of its light: what is shown of more of each term,
    // by channel, over all that is shown.
    AngleFactors shownByAngle(uint32_t side, const glm::vec4& angles) const;

    const Scene& scene;
    const Patches& patches;
    const Visibility& visibility;
    const uint32_t seed;
    const Skips skips;
    bool showsByAngle;                           // whether any material does
    std::unique_ptr<const EmissionSplit> split;  // sources refer to it
    std::vector<std::unique_ptr<LightSource>> sources;
};

}  // namespace raybundle
