// SPDX-License-Identifier: GPL-3.0-or-later
//
// PLANE and PLANES: planes across the bundle at random depths. Each plane has two depth buffers,
// which hold the nearest fragment on either side of the plane in each pixel. These two fragments
// see each other. A pair that a plane crosses with the probability p stands for 1 / p lines. No
// lists are built and nothing is sorted, so that the memory per pixel does not depend on the scene.
//
// Sources: thesis sections 6.1-6.2 and figure 6.3 (one plane, Zd / Zdist), 6.3 and figure 6.13
// (several planes with coherence), 7.3.5 (systematic sampling, close surfaces).
// Differs:
// - With N planes, the expected number of planes that cross a pair is N Zd / Zdist, and each
//   crossing counts for the inverse. The thesis has no N, which makes its result N times too
//   bright.
// - Both buffers of a plane share one pixel grid and one scale of depth, that of the scene along
//   the direction (figure 6.3 mirrors one of them, and transposes it if width and height differ).
// - The range of the planes extends beyond the scene, so that lines to the sky are found, too, with
//   a probability that is not small.
// - Touching surfaces exchange nothing, and surfaces are two-sided; see fragment_lists.h.
// - Coherence: one pass stores the first and the last fragment between neighbouring planes, from
//   which one sweep computes all buffers. The thesis sweeps once in each direction.
// - The gaps of a pair with a common edge go down to zero, and the variance of 1 / p grows without
//   bound as pixels approach the edge. Therefore the expected number of crossings is held above
//   kLeastCrossings. The lines that this loses are below rounding error.
#pragma once

#include <cstdint>
#include <vector>

#include "bundles/depth_order.h"
#include "bundles/plane_density.h"
#include "bundles/projector.h"
#include "bundles/rasteriser.h"

namespace raybundle {

// The projector of PLANE and PLANES.
class Planes : public Projector {
  public:
    // Uses `planeCount` planes instead of input.planeCount.
    Planes(const ProjectorInput& input, int planeCount);

    void project(const Bundle& bundle, BundleLines& out) override;

  private:
    // A fragment: depth << 32 | side that faces against the direction. Depths from 0 to 2^32 cover
    // the range of the planes. kNone stands for no fragment, which is the sky.
    using Key = uint64_t;
    // The first and the last fragment of a pixel between two planes, or beyond the outermost plane.
    struct Slab {
        Key first, last;
    };
    // The nearest fragments of a pixel before and behind a plane.
    struct Buffers {
        Key below, above;
    };
    class Runs;

    template <class Visit>
    void forEachFragment(const Visit& visit);
    void measureDensity();
    void placePlanes(uint64_t seed);
    void sweep(Runs& runs);
    void projectOneByOne(Runs& runs);
    void addPair(uint32_t pixel, uint32_t firstPlane, uint32_t crossings, Key below, Key above,
                 Runs& runs) const;

    // Returns whether fragment a comes before fragment b. Coinciding fragments are in the order of
    // comesBefore.
    bool isBefore(Key a, Key b) const;
    // Replace `first` (`last`) by `fragment` if it comes before (after) it, or if there is none
    // yet.
    void keepFirst(Key& first, Key fragment) const;
    void keepLast(Key& last, Key fragment) const;
    // Returns the depth of b less that of a, metres.
    double along(Key a, Key b) const;

    const ProjectorInput input;
    const uint32_t planeCount;
    DepthOrder depthOrder;
    Rasteriser rasteriser;

    double depthLow = 0, depthSteps = 1;  // start of the range of planes, metres; steps per metre
    uint64_t zoneSteps = 0;               // fragments farther apart are ordered by depth alone
    PlaneDensity density;
    std::vector<uint32_t> fragmentsInBin;  // per bin of the density
    std::vector<uint32_t> planes;          // depths in steps; a plane lies just before its step
    std::vector<Slab> slabs;               // index: pixel * (planeCount + 1) + slab
    std::vector<Buffers> buffers;          // index: pixel * planeCount + plane
};

}  // namespace raybundle
