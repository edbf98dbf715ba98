// SPDX-License-Identifier: GPL-3.0-or-later
//
// Direct light: the irradiance that receivers (patch sides, or points on them) get straight from
// the light sources. Each receiver samples each source with stratified shadow rays. If the source
// has a closed form of the irradiance without occluders, the rays estimate only the visible share
// of the source. Fully lit and fully dark receivers then have no noise.
//
// Sources: Szecsi, Sbert and Szirmay-Kalos, "Combined Correlated and Importance Sampling in Direct
// Light Source Computation" (2004) for the closed form as a control variate.
// Differs:
// - Emission that bundles carry without much noise is no source here
//   (direct_light/emission_split.h).
// - Each light set has its own DirectLight, which is independent of the other sets. The light of a
//   set is the same, sample for sample, as in a scene without other lights.
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

// The result of the coarse pass of a first shot, with few samples at each receiver.
struct CoarseShot {
    std::vector<Gathered> gathered;  // per receiver
    // Per source, and for all sources that are sampled as one: whether it lights any receiver.
    std::vector<bool> seen;
    double bundled = 0;  // estimated irradiance by emission left to the bundles, W/m^2
    // Per receiver: where the samples of a source that surrounds it went. Empty: not kept.
    std::vector<Sightings> sightings = {};
    // Per receiver, whether `gathered` is its own light and not that of a stand-in. Empty: all.
    std::vector<bool> isOwn = {};
};

// Number of sources up to which each may have the whole error that a receiver may have, and no
// weights of the sources are estimated.
constexpr size_t kFewSources = 4;

class JointSource;
struct ReceiverPlace;

// Returns an unbiased estimate of the irradiance at a receiver from one sample of each source,
// W/m^2. `index` is the index of the sample.
glm::vec3 sampleEach(const LightSources& sources, const Patches& patches,
                     const Visibility& visibility, const Receiver& receiver, uint32_t index,
                     uint32_t seed);

class DirectLight {
  public:
    // Prepares the sources of one light set, or with kNoLightSet the sources that belong to no set.
    // All arguments must outlive the object.
    DirectLight(const Scene& scene, const Patches& patches, const Visibility& visibility,
                uint32_t seed, int32_t lightSet = kNoLightSet, const Skips& skips = {});

    // Prepares reflecting surfaces as sources: the sides that `reflected` marks as sources emit
    // what it lists as gathered.
    DirectLight(const Scene& scene, const Patches& patches, const Visibility& visibility,
                uint32_t seed, const Skips& skips, EmissionSplit reflected);

    // Returns the emission of the light set per side, W/m^2.
    const std::vector<glm::vec3>& emission() const { return split->emitted; }
    // Return the number of sides, and their power in W, whose emission is left out because no
    // surface can receive it.
    size_t unseenSides() const { return split->unseen; }
    const glm::dvec3& unseenPower() const { return split->unseenPower; }

    // Returns the emission per side that is no source here and is left to the bundles, W/m^2.
    const std::vector<glm::vec3>& bundledEmission() const { return split->bundled; }
    const LightSources& lightSources() const { return sources; }
    // Returns whether any source surrounds the receivers (Receiver::Of::SURROUNDING).
    bool isSurrounding() const;

    // Gathers the light at `count` receivers with a relative standard error of about `targetError`
    // each. A coarse pass samples all receivers. Further passes sample those whose error is too
    // large compared with the mean light. If a source surrounds the receivers, further samples are
    // concentrated on its visible parts (direct_light/outlook.h).
    //   progress    receives the finished share, 0 to 1
    //   first       result of the coarse pass at all receivers, or empty to compute it here
    //   neighbours  pairs of receivers beside each other. A receiver with a neighbour starts with
    //               half the samples and gets more if its neighbours disagree with it about a
    //               shadow.
    //   bySource    receives the light of each source; null, or sized for `count` receivers. It is
    //               complete only if the coarse pass got it too.
    std::vector<Gathered> gather(size_t count, const std::function<Receiver(size_t)>& receiverAt,
                                 float targetError, const std::function<void(double)>& progress,
                                 CoarseShot first = {},
                                 const std::vector<ReceiverPair>& neighbours = {},
                                 LightBySource* bySource = nullptr) const;

    // Computes the light from the light that sources gave before, and gathers only that of the
    // sources that are fresh. Only receivers whose error is too large compared with the present
    // light are sampled again from all sources. The other arguments are those of gather().
    std::vector<Gathered> gatherFresh(const LightBySource& before,
                                      const LightBySource::Matches& matches,
                                      const std::function<Receiver(size_t)>& receiverAt,
                                      float targetError,
                                      const std::function<void(double)>& progress,
                                      const std::vector<ReceiverPair>& neighbours) const;

    // Runs the coarse pass of gather() at the receivers `these`. See gather() for `neighbours` and
    // `bySource`.
    void shootCoarsely(CoarseShot& coarse, const std::vector<uint32_t>& these,
                       const std::function<Receiver(size_t)>& receiverAt,
                       const std::function<void(double)>& progress,
                       const std::vector<ReceiverPair>& neighbours = {},
                       LightBySource* bySource = nullptr) const;
    // Runs the coarse pass of gather() at all of `count` receivers, and returns its result, from
    // which gather() goes on. The other arguments are those of gather().
    CoarseShot shootCoarsely(size_t count, const std::function<Receiver(size_t)>& receiverAt,
                             const std::function<void(double)>& progress,
                             const std::vector<ReceiverPair>& neighbours,
                             LightBySource* bySource) const;

    // Returns the result of sampleEach() for the sources.
    glm::vec3 sample(const Receiver& receiver, uint32_t index) const {
        return sampleEach(sources, patches, visibility, receiver, index, seed);
    }

    // Computes the irradiance that `count` points on a patch side get if nothing blocks the light,
    // W/m^2. If a source is so far away that its light changes by less than a share `even` over the
    // patch, the value at the centre of the patch is used for all points.
    void unblocked(uint32_t side, const glm::vec3* points, size_t count, float even,
                   glm::vec3* light) const;

    // Returns whether the sources give a side light that lines ending at the first surface would
    // miss, because a source casts no shadow or the side's own instance does not stop direct light.
    bool hasPassingLight(uint32_t side) const;

    // Estimates by rays from each of the given sources which share of its power escapes and which
    // is covered. The shares of other sources, and of those without power of their own, are 0.
    std::vector<PowerShares> powerShares(const std::vector<size_t>& these) const;
    // Returns the shares of all sources.
    std::vector<PowerShares> powerShares() const;

  private:
    class SourceGather;
    // Creates the object without sources.
    DirectLight(const Scene& scene, const Patches& patches, const Visibility& visibility,
                uint32_t seed, const Skips& skips, std::unique_ptr<const EmissionSplit> split);

    // Per source, and for those sampled as one: whether it lights any receiver.
    using Seen = std::vector<std::atomic<bool>>;
    Seen noneSeen() const { return Seen(sources.size() + 1); }

    // Returns the light at a receiver, given by its index, for an aim.
    using GatherAt = std::function<Gathered(uint32_t receiver, const Aim& aim)>;
    // Replaces the results of the receivers `these`. `progress` receives the share of this, 0 to
    // 0.5.
    void gatherThese(std::vector<Gathered>& results, const Aims& these, const GatherAt& gatherAt,
                     const std::function<void(double)>& progress) const;
    // What further passes need besides the results of the first.
    struct Passes {
        const std::function<Receiver(size_t)>& receiverAt;
        float targetError;
        const std::function<void(double)>& progress;
        const std::vector<ReceiverPair>& neighbours;
    };
    // Samples the receivers of `further` again, and in further passes their neighbours, as long as
    // these find edges of shadows.
    void refine(std::vector<Gathered>& results, Aims further, const Passes& passes,
                const GatherAt& gatherAt) const;
    // Adds the light of the sources `fresh` to `results`, which hold the light of all others.
    void addFresh(std::vector<Gathered>& results, const std::vector<size_t>& fresh,
                  const Passes& passes, Seen& seen) const;
    // Gathers at one receiver. `parts`, per source, receives the light of each; may be null.
    // `sightings` receives where the samples of the source with parts went; may be null.
    Gathered gather(const Receiver& receiver, const Aim& aim, Seen& seen, LightPart* parts,
                    Sightings* sightings) const;
    // Gathers from one source. Adds the counts of rays and skipped sources to `sum`.
    LightPart gatherFrom(size_t source, const Receiver& receiver, const ReceiverPlace& place,
                         const Aim& aim, Seen& seen, Sightings* sightings, Gathered& sum) const;
    // Returns whether the light that a side gets from a source is not covered by the source's
    // power.
    bool isUnpowered(size_t source, uint32_t side) const;
    // Returns the source that surrounds the receivers and has parts; null if there is none.
    const LightSource* surrounding() const;
    // Sets the outlooks of receivers that see little of the surrounding source, and returns the
    // outlooks, which the aims point to. The first outlooks are made from the sightings of the
    // coarse pass, the second from more samples that follow the first. Adds the rays to `results`.
    std::array<Outlooks, 2> lookAround(Aims& further, std::vector<Gathered>& results,
                                       const std::function<Receiver(size_t)>& receiverAt,
                                       std::vector<Sightings> sightings) const;
    void look(const LightSource& source, const Receiver& receiver, const Outlook& outlook,
              Sightings& sightings, Gathered& sum) const;
    std::vector<float> unblockedWeights(const ReceiverPlace& place) const;
    float shareOfTolerance(float share) const;
    std::vector<JointSource> jointSources(uint32_t side, const ReceiverPlace& place,
                                          const std::vector<float>& weights) const;
    bool isOutOfSight(const LightSource& source, const ReceiverPlace& place) const;
    // Returns, per angle term and channel, how much more of the light a side shows if a term is
    // larger, relative to all light that it shows. `angles` holds the means of the angleTerms of
    // its light.
    AngleFactors shownByAngle(uint32_t side, const glm::vec4& angles) const;

    const Scene& scene;
    const Patches& patches;
    const Visibility& visibility;
    const uint32_t seed;
    const Skips skips;
    bool showsByAngle;                           // whether any material shows light by its angle
    std::unique_ptr<const EmissionSplit> split;  // the sources refer to it
    LightSources sources;
};

}  // namespace raybundle
