// SPDX-License-Identifier: GPL-3.0-or-later
//
// FRAGMENT_LISTS: the exact projector. All parents are rasterised on the transillumination plane of
// a bundle. Each pixel keeps the list of its fragments, ordered by depth. Two consecutive fragments
// of a list exchange light along the line of the pixel.
//
// Sources: thesis sections 4.2.1-4.2.2 and figures 4.10-4.12 (lists of polygons per pixel).
// Differs:
// - Fragments are ordered by their depth at the pixel's centre. The thesis orders polygons by the
//   painter's algorithm, whose centroid order is not an order of visibility.
// - Lines that leave the scene are counted on a sky column.
// - Surfaces that touch exchange nothing. Nobody sees the covered part of a patch, so it counts as
//   not existing.
// - Surfaces are two-sided. Each fragment has one line on its front and one on its back.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "bundles/depth_order.h"
#include "bundles/projector.h"
#include "bundles/rasteriser.h"
#include "bundles/run_lengths.h"
#include "patches/patches.h"

namespace raybundle {

// The projector of FRAGMENT_LISTS.
class FragmentLists : public Projector {
  public:
    // `pixelSize` is the edge of a pixel in metres, equal for all bundles. `windows` have finer
    // pixels. `patches` must outlive the object.
    FragmentLists(const Patches& patches, float pixelSize,
                  SmallPatches smallPatches = SmallPatches::CENTRE_SAMPLING,
                  std::vector<LineWindow> windows = {});

    void project(const Bundle& bundle, BundleLines& out) override;

  private:
    // Projects the current view of the rasteriser.
    void projectView(BundleLines& out);
    // Stores the fragments of neighbouring pixels (see Rasteriser::forEachRun).
    void keepRun(uint32_t pixel, int count, const double* depth, const uint32_t* side);
    // Collects the fragments of a pixel in `keys`, unordered.
    void collect(uint32_t pixel, uint32_t count);
    // Returns the depth of fragment b less that of fragment a, metres.
    double along(uint64_t a, uint64_t b) const;
    // Returns whether the depths of two fragments are so close that the fragments may touch.
    bool areNear(uint64_t a, uint64_t b) const;
    // Corrects the order of coinciding fragments in a list ordered by depth.
    void orderCoinciding(uint64_t* first, uint64_t* last) const;
    // Appends the lines of all pixels to `out`.
    void pairLists(BundleLines& out);
    // Appends the lines of an ordered list in which some neighbours may touch.
    void pairNear(const uint64_t* first, const uint64_t* last, BundleLines& out);

    DepthOrder depthOrder;
    // Whether lines may pass through the surface of a solid, as with ROULETTE.
    const bool hasLeaks;
    Rasteriser rasteriser;

    static constexpr uint32_t kLayers = 8;  // fragments per pixel that need no chain
    // A fragment in the chain of a pixel.
    struct Link {
        uint64_t key;
        // Index into `links` of the previous link. Undefined in the first link of a pixel.
        uint32_t next;
    };

    // A fragment's key is depth << 32 | side. Its depth is quantised over the depth range of the
    // scene.
    double depthSteps = 1;  // steps of quantised depth per metre
    // Constant that moves the digits of a quantised depth to the low half of a double.
    double depthOffset = 0;
    uint32_t nearSteps = 0;  // DepthOrder::zone in steps
    // The k-th fragment of a pixel lies in layer k, or in the pixel's chain if there is no such
    // layer.
    std::vector<uint32_t> counts;  // per pixel: number of its fragments
    // Keys, kLayers * pixelRoom of them. Uninitialised until used.
    std::unique_ptr<uint64_t[]> layers;
    // Number of pixels that `layers` has space for.
    size_t pixelRoom = 0;
    std::vector<Link> links;
    // Per pixel with more than kLayers fragments: index of its last link.
    std::vector<uint32_t> chain;
    std::vector<uint64_t> keys;  // of the current pixel
    RunLengths runs;
    std::vector<uint32_t> sky;  // of the current view
};

}  // namespace raybundle
