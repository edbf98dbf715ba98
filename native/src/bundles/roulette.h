// SPDX-License-Identifier: GPL-3.0-or-later
//
// ROULETTE: the thesis' treatment of small patches. Each patch is projected separately by a polygon
// filler, which makes it at least one pixel wide and high. A patch whose projection is smaller than
// a pixel is drawn only with the probability of its projected area over the pixel's area, and then
// on the one pixel that contains its centroid. The expected number of lines of a patch seen alone
// is therefore its projected area over the pixel's area.
//
// Sources: thesis sections 4.1.1 and 4.3.1 (polygon filler), 4.6 and figures 4.21-4.23.
// Differs:
// - A pixel belongs to the patch that contains its centre, so that the area of large patches is
//   right (as in section 4.3.1). If the patch's extent contains the centre of a row or column, but
//   the patch gets no pixel there, it gets one.
// - A patch drawn by chance takes one pixel, where the thesis' filler may take several.
// - The random number is a hash of the bundle and the patch.
//
// Errors that remain, for comparison with CENTRE_SAMPLING: patches of more than a pixel's area that
// are thinner than a pixel get too many lines. Neighbouring patches take a pixel twice, and then
// touch each other, or they miss it. Where the patches of a closed surface miss a pixel, its line
// passes into the solid.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "bundles/directions.h"

namespace raybundle {

// The coordinates of a pixel.
struct Pixel {
    int x, y;
};

// Decides at random which small patches are drawn.
class Roulette {
  public:
    // Sets the current bundle.
    void begin(const Bundle& bundle);

    // Returns whether to draw a patch. `projectedArea` is its projected area in pixels, below 1.
    bool isDrawn(uint32_t patch, double projectedArea) const;

  private:
    uint32_t seed = 0;  // of the current bundle
};

// Finds the pixels of convex polygons.
class PolygonFiller {
  public:
    // Returns the pixels of the polygon with the given corners (at most 4, in order around the
    // polygon, in units of pixels), without duplicates. The result is valid until the next call.
    const std::vector<Pixel>& fill(const glm::dvec2* corners, int count);

  private:
    std::vector<Pixel> pixels;
    std::vector<bool> filledColumns;  // per column of the polygon's extent
};

}  // namespace raybundle
