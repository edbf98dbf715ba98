// SPDX-License-Identifier: GPL-3.0-or-later
//
// Groups of parents that lie together, to put windows of finer pixels around
// (bundles/line_windows.h).
//
// Source: groups are split where that saves the most lines, as in a surface area heuristic
// (Goldsmith and Salmon, "Automatic Creation of Object Hierarchies for Ray Tracing", 1987).
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

// A box around parents, metres, relative to Patches::centre, along Patches::axes.
struct WindowBox {
    glm::vec3 low{std::numeric_limits<float>::max()}, high{-std::numeric_limits<float>::max()};

    void add(const glm::vec3& p) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    void add(const WindowBox& other) {
        low = glm::min(low, other.low);
        high = glm::max(high, other.high);
    }
    bool isEmpty() const { return low.x > high.x; }
    // Of its shadow, mean over all directions (Cauchy): a quarter of the surface.
    double meanShadow() const {
        if (isEmpty()) return 0;
        const glm::dvec3 d(high - low);
        return 0.5 * (d.x * d.y + d.y * d.z + d.z * d.x);
    }
    // Of the rectangle around its shadow, which is what a window has, mean over all directions and
    // turns of the plane, in proportion: for a cube it is the shadow. (Of two axes at right angles
    // at random |r.x u.x| has the mean 2 / (3 pi), and |r.x u.y| by simulation 0.2705.)
    double meanRectangle() const {
        if (isEmpty()) return 0;
        const glm::dvec3 d(high - low);
        return 0.141 * glm::dot(d, d) + 0.359 * (d.x * d.y + d.y * d.z + d.z * d.x);
    }
};

using ParentGroup = std::vector<uint32_t>;  // into Patches::parents

class ParentGroups {
  public:
    // `patches` must outlive the object.
    explicit ParentGroups(const Patches& patches);

    double patchArea(uint32_t parent) const {
        return double(patches.area[patches.parents[parent].firstPatch]);
    }
    // Of a parent, or of the cluster that it stands for (patches/clusters.h), m^2.
    double area(uint32_t parent) const {
        return std::max(double(patches.parents[parent].area()), patchArea(parent));
    }
    size_t patchCount(const ParentGroup& members) const;
    WindowBox boxOf(const ParentGroup& members) const;

    // Splits a group into mostGroups at most, each for a window with pixels of that area, m^2.
    std::vector<ParentGroup> split(ParentGroup members, double pixelArea, size_t mostGroups) const;

    // Without the members of objects that are dust or wires: nearly all lines of a window would
    // pass them by.
    ParentGroup withoutDust(const ParentGroup& members) const;
    // Without the starved patches of objects that hardly have any by area: slivers between large
    // faces, whose light is that of what lies beside them. starvedArea: patches of less are, m^2.
    ParentGroup withoutCrumbs(const ParentGroup& members, double starvedArea) const;

  private:
    double cost(const WindowBox& box, double pixelArea) const;
    bool cut(ParentGroup& group, ParentGroup& part, double pixelArea) const;

    const Patches& patches;
    std::vector<WindowBox> boxes;  // per parent
};

}  // namespace raybundle
