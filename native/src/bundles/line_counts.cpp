// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/line_counts.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

namespace raybundle {
namespace {

// An exchange seen from one of its ends: partner, half and lines packed into one key.
uint32_t partnerOf(uint64_t key) { return uint32_t(key >> 32); }
uint32_t halfOf(uint64_t key) { return uint32_t(key >> 31) & 1; }
uint32_t linesOf(uint64_t key) { return uint32_t(key) & 0x7fffffffu; }

// Sides are handled in blocks of 2^kBlockBits rows: a block is the unit of parallel work.
constexpr uint32_t kBlockBits = 8;

// Memory without the zeros that a vector would write first.
template <class T>
std::unique_ptr<T[]> uninitialised(size_t n) {
    return std::unique_ptr<T[]>(new T[n]);
}

// Bits of a partner that one pass of the sort below looks at, at most.
constexpr uint32_t kMostDigitBits = 11;

// The keys of a block, and the row of each within the block.
struct Keys {
    uint64_t* key;
    uint8_t* row;
};

// Sorts the keys of a block by partner, stably and least significant digit first; partners have so
// many bits. Returns where the sorted keys are: in `keys` or in `spare`.
Keys sortByPartner(Keys keys, Keys spare, size_t count, uint32_t partnerBits) {
    const uint32_t passes = (partnerBits + kMostDigitBits - 1) / kMostDigitBits;
    const uint32_t digitBits = (partnerBits + passes - 1) / passes;
    const uint32_t mask = (1u << digitBits) - 1;
    std::vector<uint32_t> place(mask + 2);
    for (uint32_t pass = 0; pass < passes; ++pass) {
        const uint32_t shift = pass * digitBits;
        std::fill(place.begin(), place.end(), 0u);
        for (size_t k = 0; k < count; ++k) ++place[(partnerOf(keys.key[k]) >> shift & mask) + 1];
        std::partial_sum(place.begin(), place.end(), place.begin());
        for (size_t k = 0; k < count; ++k) {
            const uint32_t at = place[partnerOf(keys.key[k]) >> shift & mask]++;
            spare.key[at] = keys.key[k];
            spare.row[at] = keys.row[k];
        }
        std::swap(keys, spare);
    }
    return keys;
}

}  // namespace

LineCounts::LineCounts(size_t sideCount)
    : sky(sideCount, {0, 0}),
      total(sideCount, {0, 0}),
      touching(sideCount, 0),
      rows(sideCount + 1, 0),
      entries(new LineCount[0]) {}

size_t LineCounts::byteCount() const {
    return rows.back() * sizeof(LineCount) + rows.size() * sizeof(size_t) +
           sideCount() * (2 * sizeof(sky[0]) + sizeof(touching[0])) + met.size() * sizeof(met[0]);
}

std::vector<float> LineCounts::exposedShare() const {
    std::vector<float> share(sideCount(), 1.0f);
    for (size_t i = 0; i < share.size(); ++i) {
        const float open = float(total[i][0] + total[i][1]);
        if (touching[i] > 0) share[i] = open / (open + float(touching[i]));
    }
    return share;
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

void LineCounts::dropExchanges() {
    std::fill(rows.begin(), rows.end(), 0);
    entries.reset(new LineCount[0]);
}

void LineCounts::add(const std::vector<TracedBundle>& bundles) {
    const size_t n = sideCount();
    for (const TracedBundle& traced : bundles) {
        traced.lines.forEachSky(
            [&](uint32_t side, uint32_t weight) { sky[side][traced.bundle.half] += weight; });
        traced.lines.forEachTouching(
            [&](uint32_t side, uint32_t weight) { touching[side] += weight; });
    }
    countMet(bundles);
    this->bundles += uint32_t(bundles.size());

    // Sort the directed exchanges by block, stably in the order of the bundles.
    const size_t blocks = (n >> kBlockBits) + 1;
    std::vector<std::vector<size_t>> places(bundles.size(), std::vector<size_t>(blocks, 0));
    tbb::parallel_for(size_t(0), bundles.size(), [&](size_t b) {
        for (const Exchange& e : bundles[b].lines.exchanges) {
            ++places[b][e.i >> kBlockBits];
            ++places[b][e.j >> kBlockBits];
        }
    });
    std::vector<size_t> blockBegin(blocks + 1, 0);
    size_t place = 0;
    for (size_t block = 0; block < blocks; ++block) {
        blockBegin[block] = place;
        for (std::vector<size_t>& ofBundle : places) {
            const size_t count = ofBundle[block];
            ofBundle[block] = place;
            place += count;
        }
    }
    blockBegin[blocks] = place;
    const auto keys = uninitialised<uint64_t>(place);
    const auto rowOf = uninitialised<uint8_t>(place);  // within the block
    tbb::parallel_for(size_t(0), bundles.size(), [&](size_t b) {
        const uint64_t half = uint64_t(bundles[b].bundle.half) << 31;
        auto put = [&](uint32_t row, uint32_t partner, uint32_t count) {
            const size_t at = places[b][row >> kBlockBits]++;
            keys[at] = uint64_t(partner) << 32 | half | count;
            rowOf[at] = uint8_t(row & ((1u << kBlockBits) - 1));
        };
        bundles[b].lines.forEachExchange([&](const Exchange& e, uint32_t weight) {
            put(e.i, e.j, e.lines * weight);
            put(e.j, e.i, e.lines * weight);
        });
    });

    // In each block: sort by partner, group by row, merge equal partners with the row's old entries.
    uint32_t partnerBits = 1;
    while (n > size_t(1) << partnerBits) ++partnerBits;
    std::vector<size_t> merged(n + 1, 0);
    std::vector<std::unique_ptr<LineCount[]>> mergedBlocks(blocks);
    tbb::parallel_for(size_t(0), blocks, [&](size_t block) {
        const size_t firstRow = block << kBlockBits,
                     lastRow = std::min(n, (block + 1) << kBlockBits);
        if (firstRow >= lastRow) return;
        const size_t keyCount = blockBegin[block + 1] - blockBegin[block];
        const auto spareKeys = uninitialised<uint64_t>(keyCount);
        const auto spareRows = uninitialised<uint8_t>(keyCount);
        const Keys unsorted{keys.get() + blockBegin[block], rowOf.get() + blockBegin[block]};
        const Keys spare{spareKeys.get(), spareRows.get()};
        const Keys sorted = sortByPartner(unsorted, spare, keyCount, partnerBits);
        uint64_t* const grouped = (sorted.key == spare.key ? unsorted : spare).key;

        std::vector<size_t> begin(lastRow - firstRow + 1, 0);
        for (size_t k = 0; k < keyCount; ++k) ++begin[sorted.row[k] + 1u];
        std::partial_sum(begin.begin(), begin.end(), begin.begin());
        std::vector<size_t> fill(begin.begin(), begin.end() - 1);
        for (size_t k = 0; k < keyCount; ++k) grouped[fill[sorted.row[k]]++] = sorted.key[k];

        mergedBlocks[block] =
            uninitialised<LineCount>(begin.back() + rows[lastRow] - rows[firstRow]);
        LineCount* out = mergedBlocks[block].get();
        for (size_t row = firstRow; row < lastRow; ++row) {
            const uint64_t* key = grouped + begin[row - firstRow];
            const uint64_t* const lastKey = grouped + begin[row - firstRow + 1];
            const LineCount* old = rowBegin(uint32_t(row));
            const LineCount* const lastOld = rowEnd(uint32_t(row));
            LineCount* const firstOut = out;
            while (key < lastKey || old < lastOld) {
                LineCount count{0, {0, 0}};
                if (key == lastKey || (old < lastOld && old->side <= partnerOf(*key)))
                    count = *old++;
                else
                    count.side = partnerOf(*key);
                for (; key < lastKey && partnerOf(*key) == count.side; ++key)
                    count.lines[halfOf(*key)] += linesOf(*key);
                *out++ = count;
            }
            merged[row + 1] = size_t(out - firstOut);
        }
    });

    // Put the blocks one behind the other.
    std::partial_sum(merged.begin(), merged.end(), merged.begin());
    auto joined = uninitialised<LineCount>(merged[n]);
    tbb::parallel_for(size_t(0), blocks, [&](size_t block) {
        const size_t firstRow = block << kBlockBits,
                     lastRow = std::min(n, (block + 1) << kBlockBits);
        if (firstRow >= lastRow) return;
        std::copy_n(mergedBlocks[block].get(), merged[lastRow] - merged[firstRow],
                    joined.get() + merged[firstRow]);
        for (size_t row = firstRow; row < lastRow; ++row) {
            total[row] = sky[row];
            for (size_t k = merged[row]; k < merged[row + 1]; ++k) {
                total[row][0] += joined[k].lines[0];
                total[row][1] += joined[k].lines[1];
            }
        }
    });
    rows = std::move(merged);
    entries = std::move(joined);
}

}  // namespace raybundle
