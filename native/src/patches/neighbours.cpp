// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/neighbours.h"

#include <algorithm>
#include <tuple>

namespace raybundle {
namespace {

// Cosine of the largest angle between the planes of neighbours: about 25 degrees.
constexpr float kSmoothCosine = 0.9f;

// The edge of a patch on the edge of its parent.
struct BorderEdge {
    uint32_t low = 0, high = 0;      // ends of the parent's edge, into Patches::vertices
    uint32_t count = 0, number = 0;  // patches along it; which, counted from `low`
    uint32_t patch = 0;

    auto key() const { return std::make_tuple(low, high, count, number); }
};

BorderEdge borderEdge(uint32_t from, uint32_t to, uint32_t count, uint32_t number, uint32_t patch) {
    if (from < to) return {from, to, count, number, patch};
    return {to, from, count, count - 1 - number, patch};
}

void pairParallelogram(const Parent& parent, std::vector<TilePair>& pairs,
                       std::vector<BorderEdge>& border) {
    const uint32_t nA = parent.countA, nB = parent.countB;
    auto patch = [&](uint32_t a, uint32_t b) { return parent.firstTile + b * nA + a; };
    for (uint32_t b = 0; b < nB; ++b)
        for (uint32_t a = 0; a < nA; ++a) {
            if (a + 1 < nA) pairs.push_back({patch(a, b), patch(a + 1, b)});
            if (b + 1 < nB) pairs.push_back({patch(a, b), patch(a, b + 1)});
        }
    const auto& v = parent.vertex;
    for (uint32_t a = 0; a < nA; ++a) {
        border.push_back(borderEdge(v[0], v[1], nA, a, patch(a, 0)));
        border.push_back(borderEdge(v[3], v[2], nA, a, patch(a, nB - 1)));
    }
    for (uint32_t b = 0; b < nB; ++b) {
        border.push_back(borderEdge(v[0], v[3], nB, b, patch(0, b)));
        border.push_back(borderEdge(v[1], v[2], nB, b, patch(nA - 1, b)));
    }
}

// Upright triangles and those upside down between them, as in Parent::patchAt.
void pairTriangle(const Parent& parent, std::vector<TilePair>& pairs,
                  std::vector<BorderEdge>& border) {
    const uint32_t n = parent.countA;
    auto upright = [&](uint32_t column, uint32_t row) {
        return parent.firstTile + row * (2 * n - row) + 2 * column;
    };
    const auto& v = parent.vertex;
    for (uint32_t row = 0; row < n; ++row)
        for (uint32_t column = 0; column < n - row; ++column) {
            const uint32_t patch = upright(column, row);
            if (row > 0)
                pairs.push_back({patch, upright(column, row - 1) + 1});
            else
                border.push_back(borderEdge(v[0], v[1], n, column, patch));
            if (column > 0)
                pairs.push_back({patch, upright(column - 1, row) + 1});
            else
                border.push_back(borderEdge(v[0], v[2], n, row, patch));
            if (column + 1 < n - row)
                pairs.push_back({patch, patch + 1});
            else
                border.push_back(borderEdge(v[1], v[2], n, row, patch));
        }
}

}  // namespace

std::vector<TilePair> neighbouringTiles(const Patches& patches, uint32_t firstParent,
                                        uint32_t lastParent) {
    std::vector<TilePair> pairs;
    std::vector<BorderEdge> border;
    for (uint32_t p = firstParent; p < lastParent; ++p) {
        const Parent& parent = patches.parents[p];
        if (parent.isTriangle)
            pairTriangle(parent, pairs, border);
        else
            pairParallelogram(parent, pairs, border);
    }
    std::sort(border.begin(), border.end(), [](const BorderEdge& a, const BorderEdge& b) {
        return std::make_pair(a.key(), a.patch) < std::make_pair(b.key(), b.patch);
    });
    for (size_t i = 0; i < border.size();) {
        size_t end = i + 1;
        while (end < border.size() && border[end].key() == border[i].key()) ++end;
        const uint32_t a = border[i].patch, b = border[end - 1].patch;
        if (end - i == 2 && glm::dot(patches.normal(2 * a), patches.normal(2 * b)) >= kSmoothCosine)
            pairs.push_back({a, b});
        i = end;
    }
    return pairs;
}

}  // namespace raybundle
