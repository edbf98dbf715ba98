// SPDX-License-Identifier: GPL-3.0-or-later
//
// What two consecutive surfaces along a line are to each other: apart, touching, coinciding, or in
// the wrong order. All projectors that see whole lines decide it here.
//
// Words: sides a and b face against the direction; `along` is how much deeper b lies than a at the
// line, metres (negative where b is nearer).
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>

#include "patches/coincidence.h"
#include "patches/patches.h"

namespace raybundle {

class Contacts {
  public:
    // touchDistance: two surfaces not further apart than this touch, metres. `patches` must outlive
    // it.
    Contacts(const Patches& patches, float touchDistance)
        : patches(patches), touchDistance(double(touchDistance)) {}

    // Turns to the bundle along a direction.
    void begin(const glm::dvec3& newDirection) { direction = newDirection; }

    // Surfaces not further apart than this coincide: depth does not tell their order, metres.
    double coincidence() const {
        // This share of the touching distance tells coinciding surfaces from merely close ones.
        constexpr double kCoincidence = 0.05;
        return kCoincidence * touchDistance;
    }

    // Surfaces further apart along a line neither touch nor coincide, metres. (A grazing line
    // stretches the gap; beyond some stretch it is not worth a look.)
    double zone() const { return 100 * touchDistance; }

    // Distance between the two across the nearer surface, metres.
    double gapAcross(uint32_t a, double along) const {
        if (std::abs(along) > zone()) return std::abs(along);
        return std::abs(along * glm::dot(glm::dvec3(patches.normal(a)), direction));
    }

    // Whether the two lie against each other and exchange nothing.
    bool touches(uint32_t a, uint32_t b, double along) const {
        // Surfaces that meet at an angle are close only at their edge, and see each other.
        constexpr float kOpposite = -0.99f;  // cosine below which normals point against each other
        return gapAcross(a, along) <= touchDistance &&
               glm::dot(patches.normal(a ^ 1), patches.normal(b)) < kOpposite;
    }

    // Whether the two coincide and b belongs before a.
    bool belongBackwards(uint32_t a, uint32_t b, double along) const {
        return gapAcross(a, along) <= coincidence() && areSidesParallel(a, b) && isFirst(b, a);
    }

    // Whether b was put after a and belongs before it. Of surfaces that meet at an angle, only
    // beyond the touching distance: nearer to the common edge rounding decides.
    bool isDisordered(uint32_t a, uint32_t b, double along) const {
        const double gap = gapAcross(a, along);
        if (along >= 0 && gap > coincidence()) return false;
        if (!areSidesParallel(a, b)) return along < 0 && gap > touchDistance;
        return gap <= coincidence() ? isFirst(b, a) : along < 0;
    }

    // Whether a line would have to pass through the surface of a solid between two sides that face
    // each other: one lies on the inside of a solid and the other does not. (Where solids cross or
    // hold other objects, such a pair may be right.)
    bool passesIntoSolid(uint32_t i, uint32_t j) const { return isInside(i) != isInside(j); }

  private:
    bool areSidesParallel(uint32_t a, uint32_t b) const {
        return areParallel(patches.parents[patches.parentOf[a / 2]],
                           patches.parents[patches.parentOf[b / 2]]);
    }
    bool isFirst(uint32_t a, uint32_t b) const {
        return comesBefore(patches, patches.parentOf[a / 2], a % 2 == 0, patches.parentOf[b / 2],
                           b % 2 == 0);
    }
    bool isInside(uint32_t side) const {
        return side % 2 == 1 && patches.parents[patches.parentOf[side / 2]].isSolid;
    }

    const Patches& patches;
    const double touchDistance;
    glm::dvec3 direction{0, 0, 1};
};

}  // namespace raybundle
