// SPDX-License-Identifier: GPL-3.0-or-later
//
// PLANE and PLANES: planes across the bundle at random depths, with two depth buffers each, the
// nearest fragment on either side of the plane per pixel; the two see each other. A pair that is
// crossed by a plane with probability p stands for 1 / p lines. No list is built and nothing is
// sorted: memory per pixel does not depend on the scene.
//
// Sources: thesis sections 6.1-6.2 and figure 6.3 (one plane, Zd / Zdist), 6.3 and figure 6.13
// (several planes with coherence), 7.3.5 (systematic sampling, close surfaces).
// Differs from it:
// - With N planes the number of planes that cross a pair is expected to be N Zd / Zdist; each
//   crossing counts for the inverse. The thesis gives no N, which makes its result N times too
//   bright.
// - Both buffers of a plane share one pixel grid and one scale of depth, that of the scene along
//   this direction (figure 6.3 mirrors one, and transposes if width and height differ).
// - The range of the planes reaches beyond the scene, so that lines to the sky are found too, with
//   a probability that is not small.
// - Touching surfaces exchange nothing; surfaces are two-sided; see fragment_lists.h.
// - Coherence: one pass keeps the first and the last fragment between neighbouring planes, from
//   which a sweep makes all buffers, where the thesis sweeps once in each direction.
// - A pair with a common edge has gaps down to zero, and the variance of 1 / p grows without bound
//   as pixels come nearer to it. p is held above kLeastCrossings; what that loses is below rounding
//   error.
#pragma once

#include <cstdint>
#include <vector>

#include "bundles/contacts.h"
#include "bundles/plane_density.h"
#include "bundles/projector.h"
#include "bundles/rasteriser.h"

namespace raybundle {

class Planes : public Projector {
  public:
    // planeCount: instead of input's.
    Planes(const ProjectorInput& input, int planeCount);

    void project(const Bundle& bundle, BundleLines& out) override;

  private:
    // A fragment: depth << 32 | side that faces against the direction, where depth 0 to 2^32 is the
    // range of the planes. kNone: no fragment, the sky.
    using Key = uint64_t;
    // Of a pixel between two planes, or beyond the outermost one.
    struct Slab {
        Key first, last;
    };
    // Of a pixel and a plane: the nearest fragments on its two sides.
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

    // The first and the last of two fragments in order of depth.
    bool isBefore(Key a, Key b) const;
    void keepFirst(Key& first, Key fragment) const;
    void keepLast(Key& last, Key fragment) const;
    double along(Key a, Key b) const;

    const ProjectorInput input;
    const uint32_t planeCount;
    Contacts contacts;
    Rasteriser rasteriser;

    double depthLow = 0, depthSteps = 1;  // of the range: its start, metres; steps a metre
    uint64_t zoneSteps = 0;               // fragments further apart are ordered by depth alone
    PlaneDensity density;
    std::vector<uint32_t> fragmentsInBin;  // of the density
    std::vector<uint32_t> planes;          // depths in steps; a plane lies just before its step
    std::vector<Slab> slabs;               // pixel * (planeCount + 1) + slab
    std::vector<Buffers> buffers;          // pixel * planeCount + plane
};

}  // namespace raybundle
