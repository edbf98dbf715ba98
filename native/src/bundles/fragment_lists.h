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
// - Pixels are sampled at their centres with half-open edges, on a grid with a random shift: the
//   expected number of lines of a patch is its projected area over the pixel's, for every shape and
//   size, and neighbouring faces never both take or both miss a pixel.
// - Whole parents are rasterised; the patch follows from the affine coordinates.
// - Lines that leave the scene are counted on a sky column.
// - Surfaces that lie against each other exchange nothing: nobody sees the covered part of a patch,
//   which counts as not there.
// - Surfaces are two-sided: each fragment has one line on its front and one on its back.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "bundles/directions.h"
#include "patches/patches.h"

namespace raybundle {

// Two patch sides that face each other along `lines` lines of a bundle.
struct Exchange {
    uint32_t i, j;
    uint32_t lines;
};

// What one bundle gives to the counts.
struct BundleLines {
    std::vector<Exchange> exchanges;  // equal pairs may occur several times
    std::vector<uint32_t> sky;        // sides from which a line leaves the scene, once per line
    std::vector<uint32_t>
        touching;        // sides that lie against another one, once per line; no exchange
    uint64_t lines = 0;  // that meet the scene

    size_t byteCount() const {
        return exchanges.size() * sizeof(Exchange) +
               (sky.size() + touching.size()) * sizeof(uint32_t);
    }
};

class FragmentLists {
  public:
    // pixelSize: edge of a pixel in metres, the same for every bundle. touchDistance: two surfaces
    // not further apart than this touch, metres. `patches` must outlive it. One object per thread:
    // it keeps its memory from bundle to bundle.
    FragmentLists(const Patches& patches, float pixelSize, float touchDistance);

    // Projects the scene along a bundle and appends the lines to `out`.
    void project(const Bundle& bundle, BundleLines& out);

  private:
    struct Fragment {
        uint32_t pixel;
        uint32_t depth;  // quantised over the depth range of the scene
        uint32_t side;   // the side that faces against the direction
    };

    void transformVertices(const Bundle& bundle);
    void rasterise(const Parent& parent);
    void sortIntoLists();
    // Distance between two fragments of a list across the nearer surface, metres.
    double gapAcross(uint64_t a, uint64_t b) const;
    void orderCoinciding(uint64_t* first, uint64_t* last) const;
    void pairLists(BundleLines& out);

    const Patches& patches;
    const float pixelSize;
    const float touchDistance;

    glm::dvec3 right, up, direction;          // of the bundle in hand
    glm::dvec2 corner;                        // of the window around the projected scene, pixels
    int width = 0, height = 0;                // of the window, pixels
    double depthLow = 0, depthSteps = 1;      // depth in metres -> quantised depth
    std::vector<glm::dvec2> projected;        // per vertex: in the window, pixels
    std::vector<double> depth;                // per vertex, metres
    std::vector<double> spanLeft, spanRight;  // per row of a parent, pixels
    std::vector<Fragment> fragments;
    std::vector<uint32_t> begin;  // per pixel, into keys; one more at the end
    std::vector<uint64_t> keys;   // depth << 32 | side, per pixel in order of depth
};

}  // namespace raybundle
