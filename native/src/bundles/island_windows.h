// SPDX-License-Identifier: GPL-3.0-or-later
//
// Windows of finer pixels within one island, as if it were alone (bundles/line_windows.h).
#pragma once

#include <cstddef>

#include "bundles/line_windows.h"
#include "bundles/parent_groups.h"
#include "patches/patches.h"

namespace raybundle {

constexpr size_t kMostWindows = 24;
constexpr size_t kLeastPatches = 64;  // that a window is made for
// Where a window has more pixels for each of the patches that it is made for, these are slivers or
// far apart.
constexpr double kMostPixelsEach = 64;

// What one island has, by its parents, without those around it.
struct IslandDensity {
    ParentGroup members;
    size_t patchCount = 0;
    double area = 0, largest = 0;  // of its patches, m^2
    WindowBox box;
    LineDensity density;

    // What a bundle costs: pixels of its shadow, and where its surfaces are twice.
    double cost(double pixel) const { return (box.meanShadow() + area / 2) / (pixel * pixel); }
    double costAlone() const { return cost(double(density.pixelSize)) + windowPixels(); }
    // That of the windows alone.
    double windowPixels() const;
};

// Finds the windows of an island, and the pixels outside of them, if enough of its patches are
// starved by those that it has. pixelsPerPatch, leastPixelSize: see densityByDetail.
void findWindows(const Patches& patches, const ParentGroups& groups, float pixelsPerPatch,
                 float leastPixelSize, IslandDensity& island);

}  // namespace raybundle
