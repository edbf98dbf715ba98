// SPDX-License-Identifier: GPL-3.0-or-later
//
// Groups of parents that lie together, around which windows of finer pixels are placed
// (bundles/line_windows.h).
//
// Source: groups are split where this saves the most lines, as in a surface area heuristic
// (Goldsmith and Salmon, "Automatic Creation of Object Hierarchies for Ray Tracing", 1987).
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

// A box around parents, along Patches::axes; metres, relative to Patches::centre.
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
    // Returns the area of the box's shadow, averaged over all directions, m^2. By Cauchy's formula
    // it is a quarter of the surface.
    double meanShadow() const {
        if (isEmpty()) return 0;
        const glm::dvec3 d(high - low);
        return 0.5 * (d.x * d.y + d.y * d.z + d.z * d.x);
    }
    // Returns the area of the rectangle around the box's shadow, which is the shape of a window.
    // The result is averaged over all directions and rotations of the plane, m^2, and scaled so
    // that it equals the shadow for a cube. (For two random perpendicular axes, |r.x u.x| has the
    // mean 2 / (3 pi), and |r.x u.y| the mean 0.2705, by simulation.)
    double meanRectangle() const {
        if (isEmpty()) return 0;
        const glm::dvec3 d(high - low);
        return 0.141 * glm::dot(d, d) + 0.359 * (d.x * d.y + d.y * d.z + d.z * d.x);
    }
};

using ParentGroup = std::vector<uint32_t>;  // indices into Patches::parents

// Builds and splits groups of parents.
class ParentGroups {
  public:
    // `patches` must outlive the object.
    explicit ParentGroups(const Patches& patches);

    // Returns the area of the first patch of a parent, m^2.
    double patchArea(uint32_t parent) const {
        return double(patches.area[patches.parents[parent].firstPatch]);
    }
    // Returns the area of a parent, or of the cluster that it stands for (patches/clusters.h), m^2.
    double area(uint32_t parent) const {
        return std::max(double(patches.parents[parent].area()), patchArea(parent));
    }
    size_t patchCount(const ParentGroup& members) const;
    WindowBox boxOf(const ParentGroup& members) const;

    // Splits a group into at most `mostGroups`, each of which will get a window with pixels of the
    // area `pixelArea`, m^2.
    std::vector<ParentGroup> split(ParentGroup members, double pixelArea, size_t mostGroups) const;

    // Returns the members without those of objects that are dust or wires, which nearly all lines
    // of a window would miss.
    ParentGroup withoutDust(const ParentGroup& members) const;
    // Returns the members without the starved patches of objects whose starved patches have hardly
    // any area. These are slivers between large faces, whose light is that of the faces beside
    // them. Patches with an area below `starvedArea` are starved, m^2.
    ParentGroup withoutCrumbs(const ParentGroup& members, double starvedArea) const;

  private:
    // Returns the cost of a window around a box, in pixels.
    double cost(const WindowBox& box, double pixelArea) const;
    bool cut(ParentGroup& group, ParentGroup& part, double pixelArea) const;

    const Patches& patches;
    std::vector<WindowBox> boxes;  // per parent
};

}  // namespace raybundle
