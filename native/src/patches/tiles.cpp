// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/tiles.h"

#include <algorithm>
#include <cmath>

#include "job/cancellation.h"
#include "patches/side.h"

namespace raybundle {

Tiles::Tiles(const Patches& cut) : original(cut) {
    if (cut.count() == cut.tileCount) return;
    uncut.emplace(cut);
    uncut->sheets = {};
    uncut->opacity.clear();
    uncut->reflectance.clear();
    uncut->byAngle.clear();
    uncut->translucence.clear();
    uncut->emission.clear();
    uncut->parentOf.clear();
    for (size_t i = 0; i < cut.parents.size(); ++i) {
        throwIfCancelledAt(i);
        const Parent& parent = cut.parents[i];
        for (uint32_t tile = 0; tile < parent.tileCount(); ++tile) {
            first.push_back(parent.firstPatch + parent.firstOf(tile));
            levels.push_back(parent.cut ? parent.cut->level[tile] : uint8_t(0));
        }
        uncut->parents[i].cut = nullptr;
        uncut->parents[i].firstPatch = parent.firstTile;
        uncut->parentOf.resize(first.size(), uint32_t(i));
    }
    first.push_back(uint32_t(cut.count()));
    uncut->area.assign(levels.size(), 0.0f);
    for (size_t tile = 0; tile < levels.size(); ++tile)
        for (uint32_t p = first[tile]; p < first[tile + 1]; ++p) uncut->area[tile] += cut.area[p];
}

std::vector<float> Tiles::sum(const std::vector<float>& weight) const {
    if (!uncut) return weight;
    std::vector<float> result(sideCount(), 0.0f);
    parallelFor(size_t(0), result.size(), [&](size_t side) {
        for (size_t p = first[patchOf(side)]; p < first[patchOf(side) + 1]; ++p)
            result[side] += weight[sideOf(p, isBack(side))];
    });
    return result;
}

template <class Value>
std::vector<Value> Tiles::meanOf(const std::vector<Value>& values,
                                 const std::vector<float>& weight) const {
    if (!uncut) return values;
    std::vector<Value> result(sideCount(), Value(0.0f));
    parallelFor(size_t(0), result.size(), [&](size_t side) {
        const size_t tile = patchOf(side);
        if (levels[tile] == 0) {
            result[side] = values[sideOf(first[tile], isBack(side))];
            return;
        }
        float total = 0;
        for (size_t p = first[tile]; p < first[tile + 1]; ++p)
            total += weight[sideOf(p, isBack(side))];
        for (size_t p = first[tile]; p < first[tile + 1]; ++p) {
            const size_t at = sideOf(p, isBack(side));
            const float share =
                total > 0 ? weight[at] / total : original.area[p] / uncut->area[tile];
            result[side] += share * values[at];
        }
    });
    return result;
}

std::vector<float> Tiles::mean(const std::vector<float>& values,
                               const std::vector<float>& weight) const {
    return meanOf(values, weight);
}

std::vector<glm::vec3> Tiles::mean(const std::vector<glm::vec3>& values,
                                   const std::vector<float>& weight) const {
    return meanOf(values, weight);
}

std::vector<float> Tiles::errorOfMean(const std::vector<float>& errors) const {
    if (!uncut) return errors;
    std::vector<float> result(sideCount(), 0.0f);
    parallelFor(size_t(0), result.size(), [&](size_t side) {
        const size_t tile = patchOf(side);
        float variance = 0;
        for (size_t p = first[tile]; p < first[tile + 1]; ++p) {
            const float part =
                original.area[p] / uncut->area[tile] * errors[sideOf(p, isBack(side))];
            variance += part * part;
        }
        result[side] = std::sqrt(variance);
    });
    return result;
}

}  // namespace raybundle
