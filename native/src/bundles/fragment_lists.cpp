// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/fragment_lists.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "patches/coincidence.h"

namespace raybundle {
namespace {

// Depth 1 in the integer steps of a key.
constexpr double kDepthSteps = 4294967040.0;
// This share of the touching distance tells coinciding surfaces from merely close ones.
constexpr double kCoincidence = 0.05;

// Cosine below which two normals point against each other.
constexpr float kOpposite = -0.99f;

uint32_t sideOf(uint64_t key) { return uint32_t(key); }
uint32_t depthOf(uint64_t key) { return uint32_t(key >> 32); }

// Collects the exchanges of neighbouring pixels: pixel after pixel the same gap of the list usually
// belongs to the same pair.
class RunLengths {
  public:
    explicit RunLengths(std::vector<Exchange>& out) : out(out) {}

    void add(size_t gap, uint32_t i, uint32_t j) {
        if (i > j) std::swap(i, j);
        if (gap >= runs.size()) runs.resize(gap + 1, Exchange{0, 0, 0});
        Exchange& run = runs[gap];
        if (run.i == i && run.j == j) {
            ++run.lines;
            return;
        }
        if (run.lines) out.push_back(run);
        run = {i, j, 1};
    }

    void flush() {
        for (const Exchange& run : runs)
            if (run.lines) out.push_back(run);
    }

  private:
    std::vector<Exchange>& out;
    std::vector<Exchange> runs;  // the open run of each gap
};

}  // namespace

FragmentLists::FragmentLists(const Patches& patches, float pixelSize, float touchDistance)
    : patches(patches), pixelSize(pixelSize), touchDistance(touchDistance) {}

void FragmentLists::project(const Bundle& bundle, BundleLines& out) {
    transformVertices(bundle);
    fragments.clear();
    begin.assign(size_t(width) * height + 1, 0);
    for (const Parent& parent : patches.parents) rasterise(parent);
    sortIntoLists();
    pairLists(out);
}

void FragmentLists::transformVertices(const Bundle& bundle) {
    right = bundle.right;
    up = bundle.up;
    direction = bundle.direction;
    const size_t n = patches.vertices.size();
    projected.resize(n);
    depth.resize(n);
    const double perPixel = 1 / double(pixelSize);
    glm::dvec3 low(std::numeric_limits<double>::max()), high(-std::numeric_limits<double>::max());
    for (size_t v = 0; v < n; ++v) {
        const glm::dvec3 p(patches.vertices[v]);
        const glm::dvec3 q(glm::dot(p, right) * perPixel, glm::dot(p, up) * perPixel,
                           glm::dot(p, direction));
        low = glm::min(low, q);
        high = glm::max(high, q);
        projected[v] = glm::dvec2(q);
        depth[v] = q.z;
    }
    // Move the window to the scene by whole pixels, so that its corner does not undo the random
    // shift.
    corner = glm::floor(glm::dvec2(low)) - bundle.shift;
    width = int(high.x - corner.x) + 2;  // a pixel more than needed, for the rounding to float
    height = int(high.y - corner.y) + 2;
    depthLow = low.z;
    depthSteps = kDepthSteps / std::max(high.z - low.z, std::numeric_limits<double>::min());
    for (glm::dvec2& q : projected) q -= corner;
}

void FragmentLists::rasterise(const Parent& parent) {
    const int sides = parent.isTriangle ? 3 : 4;
    glm::dvec2 q[4];
    double yMin = std::numeric_limits<double>::max(), yMax = -yMin;
    double zMin = std::numeric_limits<double>::max(), zMax = -zMin;
    for (int k = 0; k < sides; ++k) {
        q[k] = projected[parent.vertex[k]];
        yMin = std::min(yMin, q[k].y);
        yMax = std::max(yMax, q[k].y);
        zMin = std::min(zMin, depth[parent.vertex[k]]);
        zMax = std::max(zMax, depth[parent.vertex[k]]);
    }
    // Row y belongs to the parent if its centre y + 0.5 lies in [yMin, yMax).
    const int row0 = int(std::ceil(yMin - 0.5)), row1 = int(std::ceil(yMax - 0.5));
    if (row0 >= row1) return;
    const glm::dvec2 ea = q[1] - q[0], eb = q[sides - 1] - q[0];
    const double det = ea.x * eb.y - ea.y * eb.x;
    if (det == 0) return;  // seen edge-on

    // Find the span of each row. An edge is evaluated from its lower end whichever way the parent
    // turns, so that two parents with a common edge find the same crossing to the last bit.
    spanLeft.resize(size_t(row1 - row0));
    spanRight.resize(size_t(row1 - row0));
    for (int k = 0; k < sides; ++k) {
        glm::dvec2 lower = q[k], upper = q[(k + 1) % sides];
        const bool rising = lower.y < upper.y;
        if (!rising) std::swap(lower, upper);
        const int first = int(std::ceil(lower.y - 0.5)), last = int(std::ceil(upper.y - 0.5));
        if (first >= last) continue;
        const double slope = (upper.x - lower.x) / (upper.y - lower.y);
        std::vector<double>& bound = rising == (det > 0) ? spanRight : spanLeft;
        for (int y = first; y < last; ++y)
            bound[size_t(y - row0)] = lower.x + (y + 0.5 - lower.y) * slope;
    }

    // Affine coordinates at a pixel, and the depth of the parent's plane. The plane is taken in
    // double from the world's coordinates, so that faces of different objects that coincide have
    // the same depth.
    const double inverse = 1 / det;
    const float dsdx = float(eb.y * inverse), dsdy = float(-eb.x * inverse);
    const float dtdx = float(-ea.y * inverse), dtdy = float(ea.x * inverse);
    const glm::dvec3 normal = glm::cross(glm::dvec3(parent.a), glm::dvec3(parent.b));
    const double slant = glm::dot(normal, direction);
    if (slant == 0) return;
    const double dzdx = -glm::dot(normal, right) / slant * double(pixelSize);
    const double dzdy = -glm::dot(normal, up) / slant * double(pixelSize);
    const double z0 = glm::dot(normal, glm::dvec3(parent.origin)) / slant +
                      (corner.x + 0.5) * dzdx + (corner.y + 0.5) * dzdy;
    // (right, up, direction) is right-handed: det < 0 where the front faces against the direction.
    const uint32_t facing = det < 0 ? 0 : 1;
    for (int y = row0; y < row1; ++y) {
        const double l = spanLeft[size_t(y - row0)], r = spanRight[size_t(y - row0)];
        const int x0 = std::max(0, int(std::ceil(l - 0.5)));
        const int x1 = std::min(width, int(std::ceil(r - 0.5)));
        const float dy = float(y + 0.5 - q[0].y);
        for (int x = x0; x < x1; ++x) {
            const float dx = float(x + 0.5 - q[0].x);
            const float s = dx * dsdx + dy * dsdy, t = dx * dtdx + dy * dtdy;
            const double z = std::clamp(z0 + x * dzdx + y * dzdy, zMin, zMax);
            const uint32_t patch = parent.firstPatch + parent.patchAt(s, t);
            const uint32_t pixel = uint32_t(y) * uint32_t(width) + uint32_t(x);
            fragments.push_back({pixel, uint32_t((z - depthLow) * depthSteps), 2 * patch + facing});
            ++begin[pixel + 1];
        }
    }
}

void FragmentLists::sortIntoLists() {
    for (size_t p = 1; p < begin.size(); ++p) begin[p] += begin[p - 1];
    keys.resize(fragments.size());
    // Fill the lists back to front: begin[p + 1] counts down to where list p starts.
    for (const Fragment& f : fragments)
        keys[--begin[f.pixel + 1]] = uint64_t(f.depth) << 32 | f.side;
    // Now begin[p + 1] is the start of list p.
    for (size_t p = 0; p + 1 < begin.size(); ++p) {
        uint64_t* const first = keys.data() + begin[p + 1];
        uint64_t* const last =
            p + 2 < begin.size() ? keys.data() + begin[p + 2] : keys.data() + keys.size();
        if (last - first > 32) {
            std::sort(first, last);
        } else {
            for (uint64_t* a = first + 1; a < last; ++a) {
                const uint64_t key = *a;
                uint64_t* b = a;
                for (; b > first && b[-1] > key; --b) *b = b[-1];
                *b = key;
            }
        }
        orderCoinciding(first, last);
    }
}

double FragmentLists::gapAcross(uint64_t a, uint64_t b) const {
    const double along = (double(depthOf(b)) - double(depthOf(a))) / depthSteps;
    // A grazing line stretches the gap; beyond some stretch it is not worth a look.
    constexpr double kMostStretch = 100;
    if (std::abs(along) > kMostStretch * double(touchDistance)) return std::abs(along);
    return std::abs(along * glm::dot(glm::dvec3(patches.normal(sideOf(a))), direction));
}

void FragmentLists::orderCoinciding(uint64_t* first, uint64_t* last) const {
    auto isBefore = [&](uint64_t a, uint64_t b) {
        const uint32_t p = patches.parentOf[sideOf(a) / 2], q = patches.parentOf[sideOf(b) / 2];
        return areParallel(patches.parents[p], patches.parents[q]) &&
               comesBefore(patches, p, sideOf(a) % 2 == 0, q, sideOf(b) % 2 == 0);
    };
    const double same = kCoincidence * double(touchDistance);
    for (uint64_t* a = first + 1; a < last; ++a)
        for (uint64_t* b = a; b > first && gapAcross(b[-1], *b) <= same && isBefore(*b, b[-1]); --b)
            std::swap(*b, b[-1]);
}

void FragmentLists::pairLists(BundleLines& out) {
    // Surfaces that meet at an angle are close only at their edge, and see each other.
    auto touches = [&](uint64_t a, uint64_t b) {
        return gapAcross(a, b) <= double(touchDistance) &&
               glm::dot(patches.normal(sideOf(a) ^ 1), patches.normal(sideOf(b))) < kOpposite;
    };
    RunLengths runs(out.exchanges);
    for (size_t p = 0; p + 1 < begin.size(); ++p) {
        const size_t first = begin[p + 1];
        const size_t last = p + 2 < begin.size() ? begin[p + 2] : keys.size();
        if (first == last) continue;
        ++out.lines;
        out.sky.push_back(sideOf(keys[first]));
        for (size_t k = first; k + 1 < last; ++k) {
            // The far side of the nearer surface sees the near side of the farther one.
            const uint32_t i = sideOf(keys[k]) ^ 1, j = sideOf(keys[k + 1]);
            if (touches(keys[k], keys[k + 1])) {
                out.touching.push_back(i);
                out.touching.push_back(j);
            } else {
                runs.add(k - first, i, j);
            }
        }
        out.sky.push_back(sideOf(keys[last - 1]) ^ 1);
    }
    runs.flush();
}

}  // namespace raybundle
