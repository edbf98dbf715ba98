// SPDX-License-Identifier: GPL-3.0-or-later
//
// ROULETTE: the thesis' way with small patches. Each patch is projected by itself by a polygon
// filler, which makes it at least a pixel wide and high; a patch whose projection is smaller than a
// pixel is drawn only with the probability of its projected area over the pixel's, and then on the
// one pixel that holds its centroid. So the expected number of lines of such a patch, seen alone,
// is its projected area over the pixel's.
//
// Sources: thesis sections 4.1.1 and 4.3.1 (polygon filler), 4.6 and figures 4.21-4.23.
// Differs:
// - A pixel belongs to the patch that holds its centre, so that the area of large patches comes out
//   right (as section 4.3.1 has it); a row or column whose centre the patch's extent holds, but
//   which gets no pixel by that, gets one.
// - A patch drawn by chance takes one pixel, where the thesis' filler may take several.
// - The random number is a hash of bundle and patch.
//
// What remains wrong with it, and is left for comparison with CENTRE_SAMPLING: patches of more than
// a pixel's area but thinner than a pixel get too many lines; neighbouring patches take a pixel
// twice (which then lie against each other) or miss it, and where the patches of a closed surface
// miss a pixel, its line passes into the solid.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "bundles/directions.h"

namespace raybundle {

struct Pixel {
    int x, y;
};

class Roulette {
  public:
    void begin(const Bundle& bundle);

    // Whether to draw a patch whose projected area, in pixels, is less than one.
    bool isDrawn(uint32_t patch, double projectedArea) const;

  private:
    uint32_t seed = 0;  // of the bundle in hand
};

// The pixels of convex polygons.
class PolygonFiller {
  public:
    // Fills the polygon with the given corners in order around (at most 4), pixels. The pixels stay
    // valid until the next call and come without duplicates.
    const std::vector<Pixel>& fill(const glm::dvec2* corners, int count);

  private:
    std::vector<Pixel> pixels;
    std::vector<bool> filledColumns;  // of the polygon's extent
};

}  // namespace raybundle
