// SPDX-License-Identifier: GPL-3.0-or-later
//
// Windows of finer pixels, in which the lines of a bundle are denser because patches are small
// there.
//
// A uniform density of lines starves small objects in large scenes: a patch of 0.1 m on a plain of
// 1 km meets a line of one bundle in ten thousand. Therefore boxes are placed around clusters of
// small patches, once per scene. For each direction, the shadow of a box on the transillumination
// plane is a window, whose pixels are finer by a power of two. A point of the plane belongs to the
// finest window over it. All lines there have the density of this window, and each stands for as
// many of the finest lines as its pixel is larger than the finest. The expected counts are those of
// uniform lines.
//
// Sources: thesis section 7.3.2 proposes separate windows for rooms, to save time, all with the
// same density. Which patches share a window: bundles/parent_groups.h.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

// A box of the scene that lines of a bundle meet more densely.
struct LineWindow {
    glm::vec3 low, high;  // metres, relative to Patches::centre, along Patches::axes
    int level;            // pixel edges are 2^level times smaller; at least 1
};

// Index of no window.
constexpr int32_t kNoWindow = -1;

// The density of lines over the scene.
struct LineDensity {
    float pixelSize;  // edge of a pixel outside of all windows, metres
    std::vector<LineWindow> windows;
    // Per parent: the innermost window that was made for it, or kNoWindow. Empty if there are no
    // windows.
    std::vector<int32_t> windowOf;
};

// Returns windows for patches that pixels of one size would starve. Each island
// (patches/patch_size.h) is treated as if it were alone. Further windows surround whole islands
// that need finer pixels than large islands far away. An island with too few starved patches gets
// no windows, and keeps its pixel size. `pixelSizes` is the edge of a pixel suited to the patches
// of each island, metres. `pixelsPerPatch` is the number of pixels that a patch should have outside
// of windows, by area. `leastPixelSizes` is per island the least edge of pixels outside of its
// windows, metres.
LineDensity densityByDetail(const Patches& patches, const std::vector<float>& pixelSizes,
                            float pixelsPerPatch, const std::vector<float>& leastPixelSizes);

// Returns the largest number of bundles for which the line counts of each half fit into 32 bits on
// every patch. It is large, unless lines are very dense or a patch is huge compared with the finest
// ones.
uint32_t mostBundles(const Patches& patches, const LineDensity& density);

}  // namespace raybundle
