// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/neighbours.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <tuple>

#include "job/cancellation.h"

namespace raybundle {
namespace {

// Cosine of the largest angle between the planes of neighbours: about 25 degrees.
constexpr float kSmoothCosine = 0.9f;

// An edge of a tile that lies on the edge of its parent.
struct BorderEdge {
    uint32_t low = 0, high = 0;      // ends of the parent's edge, indices in Patches::vertices
    uint32_t count = 0, number = 0;  // tiles along it, and the index of this one from `low`
    // Tile, counted over all parents.
    uint32_t tile = 0;
    glm::vec3 normal{0.0f};

    auto key() const { return std::make_tuple(low, high, count, number); }
};

// Makes the edge of a tile on the parent's edge from corner `fromCorner` to `toCorner`. The edge
// has `count` tiles; `number` is the index of this one from `fromCorner`.
BorderEdge borderEdge(const Parent& parent, int fromCorner, int toCorner, uint32_t count,
                      uint32_t number, uint32_t tile) {
    const uint32_t from = parent.vertex[size_t(fromCorner)], to = parent.vertex[size_t(toCorner)];
    if (from < to) return {from, to, count, number, tile, parent.normal};
    return {to, from, count, count - 1 - number, tile, parent.normal};
}

// Adds the pairs within a parallelogram, and the edges of tiles on its border.
void pairParallelogram(const Parent& parent, std::vector<TilePair>& pairs,
                       std::vector<BorderEdge>& border) {
    const uint32_t nA = parent.countA, nB = parent.countB;
    auto tile = [&](uint32_t a, uint32_t b) { return parent.firstTile + b * nA + a; };
    for (uint32_t b = 0; b < nB; ++b)
        for (uint32_t a = 0; a < nA; ++a) {
            if (a + 1 < nA) pairs.push_back({tile(a, b), tile(a + 1, b)});
            if (b + 1 < nB) pairs.push_back({tile(a, b), tile(a, b + 1)});
        }
    for (uint32_t a = 0; a < nA; ++a) {
        border.push_back(borderEdge(parent, 0, 1, nA, a, tile(a, 0)));
        border.push_back(borderEdge(parent, 3, 2, nA, a, tile(a, nB - 1)));
    }
    for (uint32_t b = 0; b < nB; ++b) {
        border.push_back(borderEdge(parent, 0, 3, nB, b, tile(0, b)));
        border.push_back(borderEdge(parent, 1, 2, nB, b, tile(nA - 1, b)));
    }
}

// Adds the pairs within a triangle, and the edges of tiles on its border. The grid consists of
// upright triangles with upside-down ones between them, ordered as in Parent::patchAt.
void pairTriangle(const Parent& parent, std::vector<TilePair>& pairs,
                  std::vector<BorderEdge>& border) {
    const uint32_t n = parent.countA;
    auto upright = [&](uint32_t column, uint32_t row) {
        return parent.firstTile + row * (2 * n - row) + 2 * column;
    };
    for (uint32_t row = 0; row < n; ++row)
        for (uint32_t column = 0; column < n - row; ++column) {
            const uint32_t tile = upright(column, row);
            if (row > 0)
                pairs.push_back({tile, upright(column, row - 1) + 1});
            else
                border.push_back(borderEdge(parent, 0, 1, n, column, tile));
            if (column > 0)
                pairs.push_back({tile, upright(column - 1, row) + 1});
            else
                border.push_back(borderEdge(parent, 0, 2, n, row, tile));
            if (column + 1 < n - row)
                pairs.push_back({tile, tile + 1});
            else
                border.push_back(borderEdge(parent, 1, 2, n, row, tile));
        }
}

}  // namespace

std::vector<TilePair> neighbouringTiles(const Patches& patches, uint32_t firstParent,
                                        uint32_t lastParent) {
    std::vector<TilePair> pairs;
    std::vector<BorderEdge> border;
    for (uint32_t p = firstParent; p < lastParent; ++p) {
        throwIfCancelledAt(p);
        const Parent& parent = patches.parents[p];
        if (parent.isTriangle)
            pairTriangle(parent, pairs, border);
        else
            pairParallelogram(parent, pairs, border);
    }
    tbb::parallel_sort(border.begin(), border.end(), [](const BorderEdge& a, const BorderEdge& b) {
        return std::make_pair(a.key(), a.tile) < std::make_pair(b.key(), b.tile);
    });
    for (size_t i = 0; i < border.size();) {
        size_t end = i + 1;
        while (end < border.size() && border[end].key() == border[i].key()) ++end;
        // More than two tiles may meet at an edge, for example where boxes with split edges stand
        // against each other. Pair only tiles for which exactly one other tile continues smoothly.
        auto onlyOne = [&](size_t k) {
            size_t other = k, count = 0;
            for (size_t m = i; m < end; ++m)
                if (m != k && glm::dot(border[k].normal, border[m].normal) >= kSmoothCosine) {
                    other = m;
                    ++count;
                }
            return count == 1 ? other : k;
        };
        for (size_t k = i; k < end; ++k)
            if (const size_t other = onlyOne(k); other > k && onlyOne(other) == k)
                pairs.push_back({border[k].tile, border[other].tile});
        i = end;
    }
    return pairs;
}

}  // namespace raybundle
