// SPDX-License-Identifier: GPL-3.0-or-later
//
// PAINTER and PAINTER_NEWELL: the patches are drawn one after the other on the transillumination
// plane, in painter's order; each pixel holds the side drawn last, with which the next one drawn
// there exchanges light before it takes the place. The two kinds differ in the order (PatchOrder).
//
// Sources: thesis sections 4.1.1-4.2.2 and figures 4.2, 4.10-4.12.
// Differs:
// - What is drawn first, and what is left in the pixels at the end, sees the sky: lines that leave
//   the scene are counted.
// - Surfaces are two-sided: each drawn patch has one line on its front and one on its back, and a
//   pixel is never cleaned.
// - Coverage and contacts are those of FRAGMENT_LISTS (Rasteriser, Contacts), so that the right
//   order gives the same exchanges line for line. Depth per pixel does not order anything: it only
//   serves to find contacts and to count the exchanges whose order is wrong.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "bundles/contacts.h"
#include "bundles/projector.h"
#include "bundles/rasteriser.h"
#include "bundles/run_lengths.h"

namespace raybundle {

// An order in which to draw patches.
class PatchOrder {
  public:
    virtual ~PatchOrder() = default;

    // Sorts `drawn`, the patches that cover a pixel, from the first along the bundle's direction to
    // the last. Returns how many cycles of patches that cover each other were broken.
    virtual uint64_t sort(const Bundle& bundle, std::vector<uint32_t>& drawn) = 0;
};

class Painter : public Projector {
  public:
    Painter(const ProjectorInput& input, std::unique_ptr<PatchOrder> order);

    void project(const Bundle& bundle, BundleLines& out) override;

  private:
    struct Fragment {
        double depth;  // metres
        uint32_t pixel;
        uint32_t side;  // that faces against the direction
    };
    struct Pixel {
        double depth;   // metres
        uint32_t side;  // drawn last; kEmpty: none
    };

    // Brings the fragments into the order of their patches, patch by patch.
    void group(const std::vector<uint32_t>& order);
    void paint(BundleLines& out);

    const std::unique_ptr<PatchOrder> order;
    Contacts contacts;
    const bool hasLeaks;  // lines may pass through the surface of a solid: ROULETTE
    Rasteriser rasteriser;

    std::vector<Fragment> fragments;  // as rasterised
    std::vector<Fragment> strokes;    // as painted
    std::vector<uint32_t> place;  // per patch: number of fragments, then where the next one goes
    std::vector<uint32_t> drawn;  // patches
    std::vector<Pixel> pixels;
    RunLengths runs;
};

}  // namespace raybundle
