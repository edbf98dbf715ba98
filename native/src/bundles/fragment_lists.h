// SPDX-License-Identifier: GPL-3.0-or-later
//
// FRAGMENT_LISTS: the exact projector. All parents are rasterised on the transillumination plane of
// a bundle; each pixel keeps the list of its fragments, ordered by depth; two consecutive fragments
// of a list exchange light along the line of the pixel.
//
// Sources: thesis sections 4.2.1-4.2.2 and figures 4.10-4.12 (lists of polygons per pixel).
// Differs from it:
// - Fragments are ordered by their depth at the pixel's centre and not by the painter's algorithm,
//   whose centroid order is not a visibility order.
// - Lines that leave the scene are counted on a sky column.
// - Surfaces that lie against each other exchange nothing: nobody sees the covered part of a patch,
//   which counts as not there.
// - Surfaces are two-sided: each fragment has one line on its front and one on its back.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "bundles/contacts.h"
#include "bundles/projector.h"
#include "bundles/rasteriser.h"
#include "bundles/run_lengths.h"
#include "patches/patches.h"

namespace raybundle {

class FragmentLists : public Projector {
  public:
    // pixelSize: edge of a pixel in metres, the same for every bundle. `patches` must outlive the
    // object.
    FragmentLists(const Patches& patches, float pixelSize,
                  SmallPatches smallPatches = SmallPatches::CENTRE_SAMPLING,
                  std::vector<LineWindow> windows = {});

    void project(const Bundle& bundle, BundleLines& out) override;

  private:
    // The view that the rasteriser has turned to.
    void projectView(BundleLines& out);
    // Fragments of neighbouring pixels, as Rasteriser::forEachRun has them.
    void keepRun(uint32_t pixel, int count, const double* depth, const uint32_t* side);
    // The fragments of a pixel, unordered.
    void collect(uint32_t pixel, uint32_t count);
    // How much deeper b lies than a, metres; and whether that is so little that they may touch.
    double along(uint64_t a, uint64_t b) const;
    bool areNear(uint64_t a, uint64_t b) const;
    void orderCoinciding(uint64_t* first, uint64_t* last) const;
    void pairLists(BundleLines& out);
    // A list in order, of which some neighbours may touch.
    void pairNear(const uint64_t* first, const uint64_t* last, BundleLines& out);

    Contacts contacts;
    const bool hasLeaks;  // lines may pass through the surface of a solid: ROULETTE
    Rasteriser rasteriser;

    static constexpr uint32_t kLayers = 8;  // fragments of a pixel that need no chain
    struct Link {
        uint64_t key;
        uint32_t next;  // into links; of the first of a pixel: anything
    };

    // A fragment's key is depth << 32 | side, its depth quantised over the range of the scene.
    double depthSteps = 1;   // depth in metres -> quantised depth
    double depthOffset = 0;  // which added to it leaves its digits in the low half of a double
    uint32_t nearSteps = 0;  // Contacts::zone in quantised depth
    // Fragment k of a pixel lies in layer k, what layers have no place for in a chain.
    std::vector<uint32_t> counts;        // per pixel: its fragments
    std::unique_ptr<uint64_t[]> layers;  // keys, kLayers times pixelRoom; unwritten until used
    size_t pixelRoom = 0;
    std::vector<Link> links;
    std::vector<uint32_t> chain;  // per pixel of more than kLayers: the last of its links
    std::vector<uint64_t> keys;   // of the pixel in hand
    RunLengths runs;
    std::vector<uint32_t> sky;  // of the view in hand
};

}  // namespace raybundle
