// SPDX-License-Identifier: GPL-3.0-or-later
//
// Windows of finer pixels within one island, treated as if it were alone (bundles/line_windows.h).
#pragma once

#include <cstddef>

#include "bundles/line_windows.h"
#include "bundles/parent_groups.h"
#include "patches/patches.h"

namespace raybundle {

// Largest number of windows of a scene.
constexpr size_t kMostWindows = 24;
// Least number of patches that a window is made for.
constexpr size_t kLeastPatches = 64;
// If a window has more pixels than this for each of the patches that it is made for, these are
// slivers or far apart.
constexpr double kMostPixelsEach = 64;

// The parents of one island, its patches and the density of its lines. Other islands are ignored.
struct IslandDensity {
    ParentGroup members;
    size_t patchCount = 0;
    double area = 0, largest = 0;  // total area, and area of the largest patch, m^2
    WindowBox box;
    LineDensity density;

    // Returns the cost of a bundle: the number of pixels of the island's shadow plus the number of
    // its fragments, both averaged over directions. `pixel` is the edge of a pixel in metres.
    double cost(double pixel) const { return (box.meanShadow() + area / 2) / (pixel * pixel); }
    double costAlone() const { return cost(double(density.pixelSize)) + windowPixels(); }
    // Returns the cost of the windows alone, in pixels.
    double windowPixels() const;
};

// Sets the windows of an island, and the size of the pixels outside of them, if its present pixels
// starve enough of its patches. For `pixelsPerPatch` and `leastPixelSize` see densityByDetail.
void findWindows(const Patches& patches, const ParentGroups& groups, float pixelsPerPatch,
                 float leastPixelSize, IslandDensity& island);

}  // namespace raybundle
