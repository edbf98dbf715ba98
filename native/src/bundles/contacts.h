// SPDX-License-Identifier: GPL-3.0-or-later
//
// What two consecutive surfaces along a line are to each other: apart, touching, coinciding, or in
// the wrong order. All projectors that see whole lines decide it here.
//
// Words: sides a and b face against the direction; `along` is how much deeper b lies than a at the
// line, metres (negative where b is nearer).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "patches/coincidence.h"
#include "patches/patches.h"

namespace raybundle {

class Contacts {
  public:
    // `patches` must outlive the object.
    explicit Contacts(const Patches& patches)
        : patches(patches), touchDistance(double(patches.touchDistance)) {}

    // Turns to the bundle along a direction.
    void begin(const glm::dvec3& newDirection) { direction = newDirection; }

    // Surfaces not further apart than this coincide: depth does not tell their order, metres.
    double coincidence() const { return kCoincidence * touchDistance; }

    // Surfaces further apart along a line neither touch nor coincide, metres. (A grazing line
    // stretches the gap; beyond some stretch it is not worth a look.)
    double zone() const { return kZone * touchDistance; }
    // The same in some islands.
    double zone(const std::vector<uint32_t>& islands) const {
        double most = 0;
        for (uint32_t island : islands)
            most = std::max(most, double(patches.islands[island].touchDistance));
        return kZone * most;
    }

    // Distance between the two across the nearer surface, metres.
    double gapAcross(uint32_t a, double along) const {
        if (std::abs(along) > zone()) return std::abs(along);
        return std::abs(along * glm::dot(glm::dvec3(patches.normal(a)), direction));
    }

    // Whether the two lie against each other and exchange nothing.
    bool touches(uint32_t a, uint32_t b, double along) const {
        // Surfaces that meet at an angle are close only at their edge, and see each other.
        constexpr float kOpposite = -0.99f;  // cosine below which normals point against each other
        return gapAcross(a, along) <= touchAt(a) &&
               glm::dot(patches.normal(a ^ 1), patches.normal(b)) < kOpposite;
    }

    // Whether the two coincide and b belongs before a.
    bool belongBackwards(uint32_t a, uint32_t b, double along) const {
        return gapAcross(a, along) <= coincidenceAt(a) && areSidesParallel(a, b) && isFirst(b, a);
    }

    // Whether b was put after a and belongs before it. Of surfaces that meet at an angle, only
    // beyond the touching distance: nearer to the common edge rounding decides.
    bool isDisordered(uint32_t a, uint32_t b, double along) const {
        const double gap = gapAcross(a, along);
        if (along >= 0 && gap > coincidenceAt(a)) return false;
        if (!areSidesParallel(a, b)) return along < 0 && gap > touchAt(a);
        return gap <= coincidenceAt(a) ? isFirst(b, a) : along < 0;
    }

    // Whether a line would have to pass through the surface of a solid between two sides that face
    // each other: one lies on the inside of a solid and the other does not. (Where solids cross or
    // hold other objects, such a pair may be right.)
    bool passesIntoSolid(uint32_t i, uint32_t j) const { return isInside(i) != isInside(j); }

  private:
    // This share of the touching distance tells coinciding surfaces from merely close ones.
    static constexpr double kCoincidence = 0.05;
    static constexpr double kZone = 100;

    double touchAt(uint32_t side) const { return double(patches.islandAt(side).touchDistance); }
    double coincidenceAt(uint32_t side) const { return kCoincidence * touchAt(side); }
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
