// SPDX-License-Identifier: GPL-3.0-or-later
//
// Rasterises the scene on the transillumination plane of a bundle, fragment by fragment.
//
// CENTRE_SAMPLING: pixels are sampled at their centres with half-open edges, on a grid with a
// random shift. The expected number of lines of a patch is its projected area over the pixel's
// area, for every shape and size. Neighbouring faces never both take a pixel, nor both miss it.
// ROULETTE: see bundles/roulette.h.
//
// The plane can be viewed in several parts, one after the other. These views are the regions that
// contain the shadows of islands (patches/patch_size.h), without the empty space between, and the
// windows with their finer pixels (bundles/line_windows.h). Each point of the plane belongs to at
// most one view. Regions have the pixels that the view of the whole scene has there.
//
// Differs from the thesis (section 4.2): except with ROULETTE, whole parents are rasterised, and
// sheets of parents (patches/sheets.h). The patch follows from the affine coordinates.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <vector>

#include "bundles/line_windows.h"
#include "bundles/projector.h"
#include "bundles/roulette.h"
#include "patches/opacity.h"
#include "patches/patches.h"
#include "patches/side.h"

namespace raybundle {

// Rasterises the parents of a scene along bundles. Keeps its memory from bundle to bundle.
class Rasteriser {
  public:
    static constexpr int kRun = 64;  // largest number of pixels of a row in a run
    // Number of loose parents, adjacent in the mesh, that are skipped together.
    static constexpr size_t kGroup = 32;
    static constexpr double kSlack = 1e-6;  // pixels; larger than the rounding error of an edge

    // `pixelSize` is the edge of a pixel outside of the windows, metres. `patches` must outlive the
    // object. ROULETTE has no windows.
    Rasteriser(const Patches& patches, float pixelSize, SmallPatches smallPatches,
               std::vector<LineWindow> windows = {});

    // Projects the scene along a bundle and selects the view of the whole scene.
    void begin(const Bundle& bundle);

    // Selects the view of a region. All regions together contain what the view of the whole scene
    // does.
    void lookAt(size_t region);
    size_t regionCount() const { return regions.size(); }

    // Selects the view of a window. Returns false if the view has no pixels.
    bool lookThrough(size_t window);
    size_t windowCount() const { return windows.size(); }
    // Returns the number of lines of the finest window that a line of the current view stands for.
    uint32_t lineWeight() const { return 1u << (2 * (finestLevel - level)); }

    // Calls visit(pixel, count, depths, sides) for all fragments in the view, parent after parent.
    // Each call covers `count` neighbouring pixels of a row, the first of which is `pixel`. Depths
    // are in metres, and the sides are those that face against the direction. There is no fragment
    // where a patch lets the line through.
    template <class Visit>
    void forEachRun(const Visit& visit) {
        if (patches.opacity.empty() && taken.empty()) return forEachCovered(visit);
        forEachCovered([&](uint32_t pixel, int count, const double* z, const uint32_t* side) {
            for (int first = 0, k = 0; k <= count; ++k) {
                if (k < count && isMet(pixel + uint32_t(k), side[k])) continue;
                if (first < k) visit(pixel + uint32_t(first), k - first, z + first, side + first);
                first = k + 1;
            }
        });
    }

    // Calls visit(pixel, depth, side) for each fragment in the view; otherwise like forEachRun().
    template <class Visit>
    void forEachFragment(const Visit& visit) {
        forEachRun([&](uint32_t pixel, int count, const double* z, const uint32_t* side) {
            for (int k = 0; k < count; ++k) visit(pixel + uint32_t(k), z[k], side[k]);
        });
    }

    // Returns the number of pixels of the view. The index of a pixel is y * width + x.
    size_t pixelCount() const { return size_t(width) * size_t(height); }
    const glm::dvec3& direction() const { return frame.direction; }
    // Return the range of depths along the direction in the view, metres.
    double depthLow() const { return lowest; }
    double depthHigh() const { return highest; }
    // Returns the number of sheets and single parents that were rasterised in all views so far.
    uint64_t drawnCount() const { return drawn; }
    // Returns the indices of the islands in the view, ascending.
    const std::vector<uint32_t>& islandsInView() const { return inSight; }

  private:
    // Returns whether the line of a pixel belongs to the view and meets the patch of a side.
    bool isMet(uint32_t pixel, uint32_t side) const {
        return (taken.empty() || !taken[pixel]) &&
               (patches.opacity.empty() || stops(patches, patchOf(side), line + pixel));
    }
    // Visits fragments as if all patches were opaque and all pixels belonged to the view.
    template <class Visit>
    void forEachCovered(const Visit& visit) {
        if (smallPatches == SmallPatches::ROULETTE) {
            for (const Parent& parent : patches.parents)
                if (parent.exchanges) fillPatches(parent, visit);
            return;
        }
        const std::vector<Sheet>& sheets = patches.sheets.sheets;
        for (uint32_t island : inSight) {
            const Island& own = islands[island];
            for (size_t k = 0; k < own.sheets.size(); ++k)
                if (windows.empty() || mayHavePixels(own.sheetBounds[k])) {
                    sampleSheet(sheets[own.sheets[k]], visit);
                    ++drawn;
                }
            forEachLooseInView(own, [&](size_t k) {
                sampleParent(patches.parents[own.loose[k].parent], visit);
                ++drawn;
            });
        }
    }
    template <class Visit>
    void sampleSheet(const Sheet& sheet, const Visit& visit);
    template <class Visit>
    void sampleParent(const Parent& parent, const Visit& visit);
    // A plane with affine coordinates (s, t): the point is origin + s a + t b, metres.
    struct Axes {
        glm::vec3 origin, a, b;
    };
    // Visits the pixels inside a convex outline. Edge k runs from vertex edge(k)[0] to vertex
    // edge(k)[1], counter-clockwise as seen from the front. patchAt(s, t) returns the index of the
    // patch. lookUp(side, count, s, t, dsdx, dtdx) corrects the sides of a run where patchAt does
    // not suffice.
    template <class EdgeAt, class PatchAt, class LookUp, class Visit>
    void sampleOutline(int edges, const EdgeAt& edge, const Axes& axes, const PatchAt& patchAt,
                       const LookUp& lookUp, const Visit& visit);
    // Draws a parent patch by patch, for ROULETTE.
    template <class Visit>
    void fillPatches(const Parent& parent, const Visit& visit);

    // Depth (metres) and affine coordinates of a parent or sheet, as linear functions over the
    // view: the value at the centre of pixel (0, 0), and the change per pixel.
    struct Plane {
        double z0, dzdx, dzdy;
        double s0, dsdx, dsdy;
        double t0, dtdx, dtdy;
        uint32_t facing;  // side that faces against the direction; 0: front, 1: back
        // Returns the depth at a position in pixels, metres.
        double at(glm::dvec2 p) const { return z0 + (p.x - 0.5) * dzdx + (p.y - 0.5) * dzdy; }
    };
    // Computes `plane` from `axes` for the current view. Returns false if it is seen edge-on.
    bool findPlane(const Axes& axes, Plane& plane) const;

    // A rectangle on the plane, in pixels of the whole scene's view, before the shift.
    struct Rectangle {
        glm::dvec2 low{std::numeric_limits<double>::max()},
            high{-std::numeric_limits<double>::max()};

        void add(const glm::dvec2& point) {
            low = glm::min(low, point);
            high = glm::max(high, point);
        }
    };
    // A rectangle, enlarged by the rounding to float, in half the memory.
    struct Bounds {
        glm::vec2 low{std::numeric_limits<float>::max()}, high{-std::numeric_limits<float>::max()};

        void add(const glm::dvec2& point);
        void add(const Bounds& other) {
            low = glm::min(low, other.low);
            high = glm::max(high, other.high);
        }
    };
    // A parent in no sheet. The vertices stand here again, so that most parents of a dense mesh,
    // which have no pixels, are left out without a look at the parent.
    struct Loose {
        uint32_t parent;
        std::array<uint32_t, 4> vertex;  // that of a triangle repeats the first one
    };
    // The content of an island, and its projection along the current bundle.
    struct Island {
        std::vector<uint32_t> sheets;    // indices into Patches::sheets
        std::vector<Loose> loose;        // in the order of the mesh
        std::vector<uint32_t> vertices;  // all vertices except those inside of sheets
        // Bounds of each sheet, of each loose parent, and of groups of loose parents. Only set if
        // there are windows.
        std::vector<Bounds> sheetBounds, looseBounds, groupBounds;
        Rectangle shadow;
        double lowest = 0, highest = 0;  // range of depths, metres
    };
    // A part of the plane with islands whose shadows overlap.
    struct Region {
        glm::dvec2 first, end;  // pixels, before the shift
        std::vector<uint32_t> islands;
    };
    void findRegions();
    // Selects a view of the given islands, which lie between two corners on the plane.
    void showIslands(std::vector<uint32_t> shown, const glm::dvec2& low, const glm::dvec2& high);
    // Returns the position of a vertex in the view, in pixels. It is identical for all parents that
    // share the vertex.
    glm::dvec2 inView(uint32_t vertex) const { return projected[vertex] * zoom - corner; }
    bool isInView(const Rectangle& r) const {
        return r.high.x * zoom > corner.x && r.low.x * zoom < corner.x + width &&
               r.high.y * zoom > corner.y && r.low.y * zoom < corner.y + height;
    }
    bool isInView(const Bounds& b) const {
        return isInView(Rectangle{glm::dvec2(b.low), glm::dvec2(b.high)});
    }
    // Returns false if no pixel of the view has its centre inside the bounds.
    bool mayHavePixels(const Rectangle& r) const {
        const glm::dvec2 low = r.low * zoom - corner - kSlack;
        const glm::dvec2 high = r.high * zoom - corner + kSlack;
        return hasPixels(low.x, high.x, width) && hasPixels(low.y, high.y, height);
    }
    bool mayHavePixels(const Bounds& b) const {
        return mayHavePixels(Rectangle{glm::dvec2(b.low), glm::dvec2(b.high)});
    }
    static bool hasPixels(double low, double high, int count) {
        return std::max(0.0, std::ceil(low - 0.5)) < std::min(double(count), std::ceil(high - 0.5));
    }
    // Calls visit(k) for the entries of Island::loose that may have pixels in the view.
    template <class Visit>
    void forEachLooseInView(const Island& island, const Visit& visit) const {
        if (windows.empty()) {
            for (size_t k = 0; k < island.loose.size(); ++k) {
                Rectangle shadow;
                for (uint32_t vertex : island.loose[k].vertex) shadow.add(projected[vertex]);
                if (mayHavePixels(shadow)) visit(k);
            }
            return;
        }
        for (size_t group = 0; group < island.groupBounds.size(); ++group) {
            if (!isInView(island.groupBounds[group])) continue;
            const size_t end = std::min(kGroup * (group + 1), island.loose.size());
            for (size_t k = kGroup * group; k < end; ++k)
                if (mayHavePixels(island.looseBounds[k])) visit(k);
        }
    }
    void findBounds(Island& island);
    // Marks the pixels that belong to finer windows. Pixels of two windows of equal level belong to
    // the first.
    void findTaken(size_t window);

    const Patches& patches;
    const float pixelSize;
    const SmallPatches smallPatches;
    const std::vector<LineWindow> windows;
    int finestLevel = 0;

    Bundle frame{};                  // the current bundle
    uint64_t line = 0;               // lineName of the bundle, changed for each view
    int level = 0;                   // level of the view
    double zoom = 1;                 // 2^level
    glm::dvec2 corner{0.0};          // of the view, in its pixels
    int width = 0, height = 0;       // of the view, in its pixels
    double lowest = 0, highest = 0;  // range of depths in the view, metres
    std::vector<Island> islands;     // in the order of Patches::islands
    std::vector<Region> regions;
    std::vector<uint32_t> inSight;      // islands in the view, ascending
    std::vector<glm::dvec2> projected;  // per vertex: position on the plane, pixels
    std::vector<Rectangle> openings;    // per window: its rectangle on the plane
    // Per pixel of the view: whether it belongs to another view. Empty if no pixel does.
    std::vector<uint8_t> taken;
    std::vector<double> depth;                // per vertex, metres
    std::vector<double> spanLeft, spanRight;  // per row of a parent, pixels
    Roulette roulette;
    PolygonFiller filler;
    uint64_t drawn = 0;  // see drawnCount()
};

template <class Visit>
void Rasteriser::sampleSheet(const Sheet& sheet, const Visit& visit) {
    auto edge = [&](int k) { return sheet.outline[size_t(k)]; };
    // By value, since the compiler cannot exclude that the sheet's grid is modified by writing
    // sides.
    auto patchAt = [grid = sheet.grid()](float s, float t) { return grid.patchAt(s, t); };
    auto lookUp = [&](uint32_t* side, int count, float s, float t, float dsdx, float dtdx) {
        if (sheet.parts.empty()) return;
        for (int k = 0; k < count; ++k)
            if (side[k] >= 2 * Sheet::kUneven)
                side[k] = 2 * sheet.patchIn(patchOf(side[k]), patches, s + float(k) * dsdx,
                                            t + float(k) * dtdx) +
                          isBack(side[k]);
    };
    sampleOutline(int(sheet.outline.size()), edge, {sheet.origin, sheet.a, sheet.b}, patchAt,
                  lookUp, visit);
}

template <class Visit>
void Rasteriser::sampleParent(const Parent& parent, const Visit& visit) {
    const int sides = parent.isTriangle ? 3 : 4;
    auto edge = [&](int k) {
        return std::array<uint32_t, 2>{parent.vertex[size_t(k)],
                                       parent.vertex[size_t((k + 1) % sides)]};
    };
    const uint32_t first = parent.firstPatch;
    auto isRight = [](uint32_t*, int, float, float, float, float) {};
    const Axes axes{parent.origin, parent.a, parent.b};
    if (parent.patchCount() == 1)
        sampleOutline(
            sides, edge, axes, [first](float, float) { return first; }, isRight, visit);
    else
        sampleOutline(
            sides, edge, axes,
            [&, first](float s, float t) { return first + parent.patchAt(s, t); }, isRight, visit);
}

template <class EdgeAt, class PatchAt, class LookUp, class Visit>
void Rasteriser::sampleOutline(int edges, const EdgeAt& edge, const Axes& axes,
                               const PatchAt& patchAt, const LookUp& lookUp, const Visit& visit) {
    double xMin = std::numeric_limits<double>::max(), xMax = -xMin;
    double yMin = std::numeric_limits<double>::max(), yMax = -yMin;
    double zMin = std::numeric_limits<double>::max(), zMax = -zMin;
    for (int k = 0; k < edges; ++k) {
        const uint32_t vertex = edge(k)[0];
        const glm::dvec2 p = inView(vertex);
        xMin = std::min(xMin, p.x);
        xMax = std::max(xMax, p.x);
        yMin = std::min(yMin, p.y);
        yMax = std::max(yMax, p.y);
        zMin = std::min(zMin, depth[vertex]);
        zMax = std::max(zMax, depth[vertex]);
    }
    // Row y belongs to the outline if its centre y + 0.5 lies in [yMin, yMax).
    const int row0 = std::max(0, int(std::ceil(yMin - 0.5)));
    const int row1 = std::min(height, int(std::ceil(yMax - 0.5)));
    if (row0 >= row1 || !hasPixels(xMin - kSlack, xMax + kSlack, width)) return;
    Plane plane;
    if (!findPlane(axes, plane)) return;

    // Find the span of each row. An edge is evaluated from its lower end, whatever the orientation
    // of the outline, so that two outlines with a common edge compute identical crossings.
    if (spanLeft.size() < size_t(row1 - row0)) {
        spanLeft.resize(size_t(row1 - row0));
        spanRight.resize(size_t(row1 - row0));
    }
    for (int k = 0; k < edges; ++k) {
        const std::array<uint32_t, 2> ends = edge(k);
        glm::dvec2 lower = inView(ends[0]), upper = inView(ends[1]);
        const bool rising = lower.y < upper.y;
        if (!rising) std::swap(lower, upper);
        const int first = std::max(row0, int(std::ceil(lower.y - 0.5)));
        const int last = std::min(row1, int(std::ceil(upper.y - 0.5)));
        if (first >= last) continue;
        const double slope = (upper.x - lower.x) / (upper.y - lower.y);
        std::vector<double>& bound = rising == (plane.facing == 1) ? spanRight : spanLeft;
        for (int y = first; y < last; ++y)
            bound[size_t(y - row0)] = lower.x + (y + 0.5 - lower.y) * slope;
    }

    const float dsdx = float(plane.dsdx), dtdx = float(plane.dtdx);
    for (int y = row0; y < row1; ++y) {
        const double l = spanLeft[size_t(y - row0)], r = spanRight[size_t(y - row0)];
        const int x0 = std::max(0, int(std::ceil(l - 0.5)));
        const int x1 = std::min(width, int(std::ceil(r - 0.5)));
        const double zRow = plane.z0 + y * plane.dzdy;
        const float s0 = float(plane.s0 + y * plane.dsdy + x0 * plane.dsdx);
        const float t0 = float(plane.t0 + y * plane.dtdy + x0 * plane.dtdx);
        const uint32_t rowStart = uint32_t(y) * uint32_t(width);
        // Separate from the visit, so that the compiler vectorises these loops.
        for (int first = x0; first < x1; first += kRun) {
            const int count = std::min(kRun, x1 - first);
            uint32_t side[kRun];
            double z[kRun];
            for (int k = 0; k < count; ++k) {
                const float dx = float(first - x0 + k);
                side[k] = 2 * patchAt(s0 + dx * dsdx, t0 + dx * dtdx) + plane.facing;
            }
            lookUp(side, count, s0 + float(first - x0) * dsdx, t0 + float(first - x0) * dtdx, dsdx,
                   dtdx);
            for (int k = 0; k < count; ++k)
                z[k] = std::min(std::max(zRow + (first + k) * plane.dzdx, zMin), zMax);
            visit(rowStart + uint32_t(first), count, z, side);
        }
    }
}

template <class Visit>
void Rasteriser::fillPatches(const Parent& parent, const Visit& visit) {
    const int sides = parent.isTriangle ? 3 : 4;
    const glm::dvec2 q0 = inView(parent.vertex[0]);
    const glm::dvec2 ea = inView(parent.vertex[1]) - q0;
    const glm::dvec2 eb = inView(parent.vertex[size_t(sides) - 1]) - q0;
    const double det = ea.x * eb.y - ea.y * eb.x;
    Plane plane;
    if (det == 0 || !findPlane({parent.origin, parent.a, parent.b}, plane)) return;
    auto visitPixel = [&](int x, int y, double z, uint32_t patch) {
        if (x < 0 || y < 0 || x >= width || y >= height) return;
        const uint32_t side = 2 * patch + plane.facing;
        visit(uint32_t(y) * uint32_t(width) + uint32_t(x), 1, &z, &side);
    };
    const double tileArea = std::abs(det) / (parent.isTriangle ? 2 : 1) / parent.tileCount();
    const glm::vec2 middle(parent.isTriangle ? 1.0f / 3 : 0.5f);
    constexpr glm::vec2 kCorners[2][4] = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}},
                                          {{0, 0}, {1, 0}, {0, 1}, {0, 0}}};
    for (uint32_t k = 0; k < parent.patchCount(); ++k) {
        const uint32_t patch = parent.firstPatch + k;
        const double area = std::ldexp(tileArea, -2 * parent.levelOf(k));  // pixels
        auto place = [&](const glm::vec2& uv) {
            const glm::dvec2 st(parent.pointOn(k, uv));
            return q0 + st.x * ea + st.y * eb;
        };
        if (area < 1) {
            if (!roulette.isDrawn(patch, area)) continue;
            const glm::dvec2 centroid = place(middle);
            visitPixel(int(std::floor(centroid.x)), int(std::floor(centroid.y)),
                       std::clamp(plane.at(centroid), lowest, highest), patch);
            continue;
        }
        glm::dvec2 corners[4];
        double zMin = highest, zMax = lowest;
        for (int c = 0; c < sides; ++c) {
            corners[c] = place(kCorners[sides == 3][c]);
            const double z = std::clamp(plane.at(corners[c]), lowest, highest);
            zMin = std::min(zMin, z);
            zMax = std::max(zMax, z);
        }
        for (const Pixel& p : filler.fill(corners, sides))
            visitPixel(p.x, p.y, std::clamp(plane.at(glm::dvec2(p.x, p.y) + 0.5), zMin, zMax),
                       patch);
    }
}

}  // namespace raybundle
