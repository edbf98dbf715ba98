// SPDX-License-Identifier: GPL-3.0-or-later
//
// The light that the dense nodes of one object get from around: from other surfaces, from an even
// world, and from sources that surround the scene, such as a sky. It is gathered at few receivers,
// which become the records of an IrradianceCache, and interpolated at all others.
//
// Source: Ward, Rubinstein and Clear (1988), see reconstruction/irradiance_cache.h.
// Differs:
// - Records are not added in the order in which places are looked at. Receivers are looked at in
//   random order, in rounds of which each looks at as many as all rounds before. The receivers of a
//   round are independent of each other, and the result does not depend on the number of threads.
// - A few rays probe the surroundings of every receiver. They tell how near other surfaces are, and
//   they contradict interpolated light that is far from what arrives, as in a hollow that no record
//   has been in. Where a mesh is so dense that a cluster of its patches has many receivers,
//   receivers beside each other share their rays.
#pragma once

#include <cstdint>
#include <vector>

#include "reconstruction/dense_nodes.h"
#include "reconstruction/final_gather.h"
#include "reconstruction/irradiance_cache.h"

namespace raybundle {

class LightAround {
  public:
    // Prepares the receivers of an instance. `gather` finds the light of surfaces and of an even
    // world. `lampLight` is per receiver of `nodes` the irradiance by sources that do not surround
    // the scene, W/m^2. References must outlive the object.
    LightAround(const ReconstructionInput& input, const SetLight& light, const FinalGather& gather,
                const DenseNodes& nodes, size_t instance, const std::vector<glm::vec3>& lampLight);

    // Returns the light at each receiver of the instance, the first of which is that of
    // DenseNodes::OfInstance::first.
    std::vector<CachedLight> atReceivers();

    // Returns the light at a point in the plane of a receiver, m, relative to Patches::centre. Its
    // variance is infinite if it is not known. Only after atReceivers().
    CachedLight at(uint32_t r, const glm::vec3& position) const {
        return cache.at(placeOf(r), position - nodes.position(own.first + r));
    }

    // Returns the mean over the receivers of the squared difference between interpolated light and
    // the light there, without half of the noise, mean over the channels, (W/m^2)^2. It is measured
    // by gathering at some of the receivers, and is so large that it is too small in one of 40
    // cases if what single receivers tell is normally distributed. Only after atReceivers().
    double surplus() const { return squaredSurplus; }

    size_t recordCount() const { return cache.count(); }
    uint64_t shadowRays() const { return rays; }  // cast so far

  private:
    // Receivers are counted from the first one of the instance.
    using Receivers = std::vector<uint32_t>;
    const Receiver& receiver(uint32_t r) const { return nodes.receivers()[own.first + r]; }
    CachePlace placeOf(uint32_t r) const;
    float lightAt(uint32_t r) const;
    float darkestLight() const;
    // Set `probes`, of all receivers or of those of one cluster, with at most `most` probes.
    void probe();
    void probe(uint32_t* first, uint32_t* last, size_t most);
    // Returns the light that is interpolated at a receiver.
    CachedLight at(uint32_t r) const { return cache.at(placeOf(r)); }
    // Returns whether a receiver is no record and interpolated light is not good enough there.
    bool wantsRecord(uint32_t r, const CachedLight& found) const;
    // How accurately receivers gather: as one of several records, as a single one, or as a test.
    struct Effort;
    static const Effort kRecord, kSingle, kTest;
    // Makes records of the receivers with `wants`, in the given order. Returns whether there are
    // any.
    bool addRecords(const Receivers& order, const std::vector<uint8_t>& wants,
                    const Effort& effort);
    // Sets surplus(). `shown` is per receiver.
    void measureSurplus(const Receivers& order, const std::vector<CachedLight>& shown);
    // Return what receivers gather.
    std::vector<CachedLight> gatherAt(const Receivers& these, const Effort& effort);
    std::vector<Gathered> gatherSurrounding(const Receivers& these, const Effort& effort);
    CachedLight gatherAt(uint32_t r, const Gathered& surrounding, const Effort& effort) const;
    Receiver receiverFor(uint32_t r, const Effort& effort) const;

    const ReconstructionInput& input;
    const SetLight& light;
    const FinalGather& finalGather;
    const DenseNodes& nodes;
    const DenseNodes::OfInstance& own;
    const std::vector<glm::vec3>& lampLight;
    const uint32_t count;                    // number of receivers
    const bool isSurrounded;                 // whether a source surrounds the scene
    const float least;                       // see darkestLight()
    std::vector<FinalGather::Probe> probes;  // per receiver
    std::vector<bool> isRecord;              // per receiver
    IrradianceCache cache;
    double squaredSurplus = 0;  // see surplus()
    uint64_t rays = 0;
};

}  // namespace raybundle
