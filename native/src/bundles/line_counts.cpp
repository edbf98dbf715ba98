// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/line_counts.h"

#include <map>

#include "job/cancellation.h"

namespace raybundle {

LineCounts::LineCounts(size_t sideCount)
    : sky(sideCount, {0, 0}),
      total(sideCount, {0, 0}),
      touching(sideCount, 0),
      halves{LineRows(sideCount), LineRows(sideCount)},
      measured(sideCount, -1.0f) {}

size_t LineCounts::byteCount() const {
    return halves[0].byteCount() + halves[1].byteCount() +
           sideCount() * (2 * sizeof(sky[0]) + sizeof(touching[0]) + sizeof(measured[0])) +
           met.size() * sizeof(met[0]);
}

std::vector<LineCount> LineCounts::row(uint32_t i) const {
    std::map<uint32_t, std::array<uint32_t, 2>> counts;
    for (size_t half = 0; half < 2; ++half)
        for (const uint32_t* e = halves[half].first(i); e < halves[half].last(i); ++e)
            counts[LineRows::sideOf(*e)][half] += LineRows::linesOf<uint32_t>()[*e & 255];
    std::vector<LineCount> row;
    for (const auto& [side, lines] : counts) row.push_back({side, lines});
    return row;
}

std::vector<float> LineCounts::exposedShare() const {
    std::vector<float> share(sideCount(), 1.0f);
    for (size_t i = 0; i < share.size(); ++i) {
        const float open = float(total[i][0] + total[i][1]);
        if (measured[i] >= 0)
            share[i] = measured[i];
        else if (touching[i] > 0)
            share[i] = open / (open + float(touching[i]));
    }
    return share;
}

std::vector<uint32_t> LineCounts::coveredInPart() const {
    std::vector<uint32_t> sides;
    for (uint32_t i = 0; i < sideCount(); ++i)
        if (touching[i] > 0 && total[i][0] + total[i][1] > 0 && measured[i] < 0) sides.push_back(i);
    return sides;
}

void LineCounts::addTotals(const std::vector<TracedBundle>& traced) {
    for (const TracedBundle& t : traced) {
        const uint32_t half = t.bundle.half;
        t.lines.forEachExchange([&](const Exchange& e, uint32_t weight) {
            total[e.i][half] += e.lines * weight;
            total[e.j][half] += e.lines * weight;
        });
        t.lines.forEachSky([&](uint32_t side, uint32_t weight) {
            sky[side][half] += weight;
            total[side][half] += weight;
        });
        t.lines.forEachTouching([&](uint32_t side, uint32_t weight) { touching[side] += weight; });
    }
    countMet(traced);
}

void LineCounts::countMet(const std::vector<TracedBundle>& traced) {
    for (const TracedBundle& t : traced) {
        if (t.lines.densities.empty()) continue;
        met.resize(sideCount(), 0);
        for (const Exchange& e : t.lines.exchanges) {
            met[e.i] += e.lines;
            met[e.j] += e.lines;
        }
        for (uint32_t side : t.lines.sky) ++met[side];
        for (uint32_t side : t.lines.touching) ++met[side];
    }
}

double LineCounts::linesMet(uint32_t side) const {
    const double counted = double(total[side][0]) + double(total[side][1]);
    if (met.empty() || counted == 0) return counted;
    return double(met[side]) * counted / (counted + double(touching[side]));
}

void LineCounts::dropExchanges() { halves = {LineRows(sideCount()), LineRows(sideCount())}; }

void LineCounts::add(const std::vector<TracedBundle>& traced) {
    for (const TracedBundle& t : traced)
        t.lines.forEachTouching([&](uint32_t side, uint32_t weight) { touching[side] += weight; });
    countMet(traced);
    bundles += uint32_t(traced.size());
    parallelFor(size_t(0), halves.size(), [&](size_t half) {
        std::vector<const BundleLines*> ofHalf;
        for (const TracedBundle& t : traced)
            if (t.bundle.half == half) ofHalf.push_back(&t.lines);
        for (const BundleLines* lines : ofHalf)
            lines->forEachSky([&](uint32_t side, uint32_t weight) {
                sky[side][half] += weight;
                total[side][half] += weight;
            });
        const std::vector<uint32_t> got = halves[half].append(ofHalf);
        for (size_t i = 0; i < got.size(); ++i) total[i][half] += got[i];
    });
}

}  // namespace raybundle
