// SPDX-License-Identifier: GPL-3.0-or-later
//
// The automatic patch size: a 64th of the scene's diagonal, and less for groups of objects that are
// tiny in a vast scene, as if they were baked without it.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <vector>

namespace raybundle {

// The bounding box of an object, metres.
struct Extent {
    glm::dvec3 low{INFINITY}, high{-INFINITY};

    void add(const glm::dvec3& point) {
        low = glm::min(low, point);
        high = glm::max(high, point);
    }
    bool isEmpty() const { return !(low.x <= high.x); }
    double diagonal() const { return isEmpty() ? 0 : glm::length(high - low); }
};

// Edge of a patch of each object, metres.
std::vector<double> automaticPatchSizes(const std::vector<Extent>& objects);

}  // namespace raybundle
