// SPDX-License-Identifier: GPL-3.0-or-later
//
// The relation of two consecutive surfaces along a line: apart, touching, coinciding, or in the
// wrong order. All projectors that see whole lines use it.
//
// In this file, the sides a and b face against the direction of the bundle, and `along` is the
// depth of b less the depth of a on the line, in metres. It is negative if b is nearer.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "patches/coincidence.h"
#include "patches/patches.h"
#include "patches/side.h"

namespace raybundle {

// Decides in which order consecutive surfaces belong along the lines of one bundle, and which of
// them touch.
class DepthOrder {
  public:
    // `patches` must outlive the object.
    explicit DepthOrder(const Patches& patches) : patches(patches) {}

    // Sets the direction of the current bundle, a unit vector.
    void begin(const glm::dvec3& newDirection) { direction = newDirection; }

    // Returns the distance up to which two surfaces coincide, metres. The depth of coinciding
    // surfaces does not determine their order.
    double coincidence() const { return kCoincidence * double(patches.touchDistance); }

    // Returns the distance along a line beyond which two surfaces neither touch nor coincide,
    // metres. A grazing line stretches the gap between them; gaps stretched beyond this distance
    // are not examined.
    double zone() const { return kZone * double(patches.touchDistance); }
    // Returns the largest such distance in the given islands, metres.
    double zone(const std::vector<uint32_t>& islands) const {
        double most = 0;
        for (uint32_t island : islands)
            most = std::max(most, double(patches.islands[island].touchDistance));
        return kZone * most;
    }

    // Returns the distance of the two sides, measured along the normal of side a, metres; the
    // distance along the line if that exceeds zone().
    double gapAcross(uint32_t a, double along) const {
        if (std::abs(along) > zone()) return std::abs(along);
        return std::abs(along * glm::dot(glm::dvec3(patches.normal(a)), direction));
    }

    // Returns whether the two sides touch, so that they exchange nothing.
    bool touches(uint32_t a, uint32_t b, double along) const {
        return gapAcross(a, along) <= touchAt(a) && pointAgainst(patches, opposite(a), b);
    }

    // Returns whether the two sides coincide and b belongs before a.
    bool belongBackwards(uint32_t a, uint32_t b, double along) const {
        return gapAcross(a, along) <= coincidenceAt(a) && areSidesParallel(a, b) && isFirst(b, a);
    }

    // Returns whether b was placed after a but belongs before it. Surfaces that meet at an angle
    // can be disordered only beyond the touch distance, since rounding decides their order nearer
    // to the common edge.
    bool isDisordered(uint32_t a, uint32_t b, double along) const {
        const double gap = gapAcross(a, along);
        if (along >= 0 && gap > coincidenceAt(a)) return false;
        if (!areSidesParallel(a, b)) return along < 0 && gap > touchAt(a);
        return gap <= coincidenceAt(a) ? isFirst(b, a) : along < 0;
    }

    // Returns whether a line between two sides that face each other would have to pass through the
    // surface of a solid, because one of them lies on the inside of a solid and the other does not.
    // Such a pair may be correct where solids intersect or contain other objects.
    bool passesIntoSolid(uint32_t i, uint32_t j) const { return isInside(i) != isInside(j); }

  private:
    // Share of the touch distance up to which close surfaces coincide.
    static constexpr double kCoincidence = 0.05;
    static constexpr double kZone = 100;

    double touchAt(uint32_t side) const { return double(patches.islandAt(side).touchDistance); }
    double coincidenceAt(uint32_t side) const { return kCoincidence * touchAt(side); }
    bool areSidesParallel(uint32_t a, uint32_t b) const {
        return areParallel(patches.parentAt(a), patches.parentAt(b));
    }
    bool isFirst(uint32_t a, uint32_t b) const {
        return comesBefore(patches, patches.parentOf[patchOf(a)], !isBack(a),
                           patches.parentOf[patchOf(b)], !isBack(b));
    }
    bool isInside(uint32_t side) const { return isBack(side) && patches.parentAt(side).isSolid; }

    const Patches& patches;
    glm::dvec3 direction{0, 0, 1};
};

}  // namespace raybundle
