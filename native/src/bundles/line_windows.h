// SPDX-License-Identifier: GPL-3.0-or-later
//
// Windows of finer pixels: where the lines of a bundle are denser because patches are small there.
//
// One density of lines starves small things in large scenes: a patch of 0.1 m on a plain of 1 km
// meets a line of one bundle in ten thousand. So boxes are put around clusters of small patches,
// once for a scene; along each direction the box's shadow on the transillumination plane is a
// window, whose pixels are finer by a power of two. A point of the plane belongs to the finest
// window over it: there every line has the density of that window, and stands for so many of the
// finest lines as its pixel is larger. The expected counts are those of uniform lines.
//
// Sources: thesis section 7.3.2 proposes windows of their own for rooms, to save time; density is
// the same in all of them. Which patches have a window together: bundles/parent_groups.h.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

// A box of the scene that lines of a bundle meet more densely.
struct LineWindow {
    glm::vec3 low, high;  // metres, relative to Patches::centre, along Patches::axes
    int level;            // its pixels are 2^level times smaller, 1 or more
};

constexpr int32_t kNoWindow = -1;

struct LineDensity {
    float pixelSize;  // edge of a pixel outside of all windows, metres
    std::vector<LineWindow> windows;
    // Per parent: the innermost window that was made for it, or kNoWindow; empty without windows.
    std::vector<int32_t> windowOf;
};

// Windows for patches that pixels of one size would starve, in each island (patches/patch_size.h)
// as if it were alone, and around whole islands whose pixels are finer than those of large ones far
// away. An island without enough starved patches has no windows in it, and its pixels stay as they
// are. pixelSizes: per island, edge of a pixel by its patches, metres; pixelsPerPatch: pixels that
// a patch should have outside of windows, by area; leastPixelSizes: per island, of the pixels
// outside of its windows, metres.
LineDensity densityByDetail(const Patches& patches, const std::vector<float>& pixelSizes,
                            float pixelsPerPatch, const std::vector<float>& leastPixelSizes);

// The most bundles with which the counts of the lines of each half fit into 32 bits on every patch:
// many, unless lines are very dense or a patch is vast beside the finest of them.
uint32_t mostBundles(const Patches& patches, const LineDensity& density);

}  // namespace raybundle
