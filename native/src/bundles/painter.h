// SPDX-License-Identifier: GPL-3.0-or-later
//
// PAINTER and PAINTER_NEWELL: patches are drawn one after the other on the transillumination plane,
// in painter's order. Each pixel holds the side drawn last. The next side drawn there exchanges
// light with this side before it takes its place. The two kinds differ in the order (PatchOrder).
//
// Sources: thesis sections 4.1.1-4.2.2 and figures 4.2, 4.10-4.12.
// Differs:
// - The first side drawn in a pixel, and the last one left in it, see the sky: lines that leave the
//   scene are counted.
// - Surfaces are two-sided. Each drawn patch has one line on its front and one on its back, and
//   pixels are never cleared.
// - Coverage and which surfaces touch are those of FRAGMENT_LISTS (Rasteriser, DepthOrder), so that
//   the correct order gives the same exchanges line by line. Depth per pixel does not order
//   anything. It only serves to find surfaces that touch and to count exchanges in the wrong order.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "bundles/depth_order.h"
#include "bundles/projector.h"
#include "bundles/rasteriser.h"
#include "bundles/run_lengths.h"

namespace raybundle {

// Interface of the orders in which patches are drawn.
class PatchOrder {
  public:
    virtual ~PatchOrder() = default;

    // Sorts the patches that cover a pixel from the first to the last along the bundle's direction.
    // Returns the number of broken cycles of patches that cover each other.
    virtual uint64_t sort(const Bundle& bundle, std::vector<uint32_t>& drawn) = 0;
};

// The projector of PAINTER and PAINTER_NEWELL.
class Painter : public Projector {
  public:
    Painter(const ProjectorInput& input, std::unique_ptr<PatchOrder> order);

    void project(const Bundle& bundle, BundleLines& out) override;

  private:
    struct Fragment {
        double depth;  // metres
        uint32_t pixel;
        uint32_t side;  // patch side that faces against the direction
    };
    struct Pixel {
        double depth;   // metres
        uint32_t side;  // last side drawn; kEmpty: none
    };

    // Copies the fragments to `strokes`, patch by patch in the given order.
    // Draws the strokes and appends their lines to `out`.
    void group(const std::vector<uint32_t>& order);
    void paint(BundleLines& out);

    const std::unique_ptr<PatchOrder> order;
    DepthOrder depthOrder;
    // Whether lines may pass through the surface of a solid, as with ROULETTE.
    const bool hasLeaks;
    Rasteriser rasteriser;

    std::vector<Fragment> fragments;  // in the order of the rasteriser
    std::vector<Fragment> strokes;    // in the order of drawing
    // Per patch: number of fragments, then index of the next stroke.
    std::vector<uint32_t> place;
    std::vector<uint32_t> drawn;  // patches with a fragment
    std::vector<Pixel> pixels;
    RunLengths runs;
};

}  // namespace raybundle
