// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/line_rows.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

namespace raybundle {
namespace {

// Sides are handled in blocks of 2^kBlockBits rows: a block is the unit of parallel work.
constexpr uint32_t kBlockBits = 8;
// More lines than this take several entries.
constexpr uint32_t kMostLines = UINT16_MAX;
// Rows that tell how much is repeated, and the repetition from which on it is joined.
constexpr size_t kSampledRows = 64;
constexpr double kMostRepetition = 2;

// Memory without the zeros that a vector would write first.
template <class T>
std::unique_ptr<T[]> uninitialised(size_t n) {
    return std::unique_ptr<T[]>(new T[n]);
}

// Calls visit(row, other side, lines) for the entries of a bundle.
template <class Visit>
void forEachEntry(const BundleLines& bundle, const Visit& visit) {
    bundle.forEachExchange([&](const Exchange& e, uint32_t weight) {
        for (uint32_t left = e.lines * weight; left > 0;) {
            const uint32_t lines = std::min(left, kMostLines);
            visit(e.i, e.j, uint16_t(lines));
            visit(e.j, e.i, uint16_t(lines));
            left -= lines;
        }
    });
}

}  // namespace

LineRows::LineRows(size_t sideCount)
    : begin(sideCount + 1, 0), entries{uninitialised<uint32_t>(0), uninitialised<uint16_t>(0)} {}

size_t LineRows::byteCount() const {
    return entryCount() * (sizeof(uint32_t) + sizeof(uint16_t)) + begin.size() * sizeof(begin[0]);
}

std::vector<uint32_t> LineRows::append(const std::vector<const BundleLines*>& bundles) {
    // Bring the entries to their blocks, in the order of the bundles.
    const size_t n = sideCount(), blocks = (n >> kBlockBits) + 1;
    std::vector<std::vector<size_t>> places(bundles.size(), std::vector<size_t>(blocks, 0));
    tbb::parallel_for(size_t(0), bundles.size(), [&](size_t b) {
        forEachEntry(*bundles[b],
                     [&](uint32_t row, uint32_t, uint16_t) { ++places[b][row >> kBlockBits]; });
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
    const auto sideOf = uninitialised<uint32_t>(place);
    const auto linesOf = uninitialised<uint16_t>(place);
    const auto rowOf = uninitialised<uint8_t>(place);  // within the block
    tbb::parallel_for(size_t(0), bundles.size(), [&](size_t b) {
        forEachEntry(*bundles[b], [&](uint32_t row, uint32_t side, uint16_t lines) {
            const size_t at = places[b][row >> kBlockBits]++;
            sideOf[at] = side;
            linesOf[at] = lines;
            rowOf[at] = uint8_t(row & ((1u << kBlockBits) - 1));
        });
    });
    auto forEachBlock = [&](const auto& body) {
        tbb::parallel_for(size_t(0), blocks, [&](size_t block) {
            body(blockBegin[block], blockBegin[block + 1], block << kBlockBits,
                 std::min(n, (block + 1) << kBlockBits));
        });
    };

    // Put them behind the entries that their rows have.
    std::vector<size_t> ends(n + 1, 0);
    std::vector<uint32_t> got(n, 0);
    forEachBlock([&](size_t first, size_t last, size_t firstRow, size_t lastRow) {
        for (size_t k = first; k < last; ++k) {
            ++ends[firstRow + rowOf[k] + 1];
            got[firstRow + rowOf[k]] += linesOf[k];
        }
        for (size_t row = firstRow; row < lastRow; ++row)
            ends[row + 1] += begin[row + 1] - begin[row];
    });
    std::partial_sum(ends.begin(), ends.end(), ends.begin());
    Entries joined{uninitialised<uint32_t>(ends[n]), uninitialised<uint16_t>(ends[n])};
    forEachBlock([&](size_t first, size_t last, size_t firstRow, size_t lastRow) {
        std::vector<size_t> next(lastRow - firstRow);
        for (size_t row = firstRow; row < lastRow; ++row) {
            const size_t count = begin[row + 1] - begin[row];
            std::copy_n(entries.side.get() + begin[row], count, joined.side.get() + ends[row]);
            std::copy_n(entries.lines.get() + begin[row], count, joined.lines.get() + ends[row]);
            next[row - firstRow] = ends[row] + count;
        }
        for (size_t k = first; k < last; ++k) {
            const size_t at = next[rowOf[k]]++;
            joined.side[at] = sideOf[k];
            joined.lines[at] = linesOf[k];
        }
    });
    begin = std::move(ends);
    entries = std::move(joined);
    if (repetition() > kMostRepetition) joinRepeated();
    return got;
}

double LineRows::repetition() const {
    size_t all = 0, different = 0;
    const size_t rows = std::min(sideCount(), kSampledRows);
    std::vector<uint32_t> sides;
    for (size_t s = 0; s < rows; ++s) {
        const size_t i = s * sideCount() / rows;
        sides.assign(entries.side.get() + begin[i], entries.side.get() + begin[i + 1]);
        std::sort(sides.begin(), sides.end());
        all += sides.size();
        different += size_t(std::unique(sides.begin(), sides.end()) - sides.begin());
    }
    return different > 0 ? double(all) / double(different) : 1;
}

void LineRows::joinRepeated() {
    // In place: a row only becomes shorter.
    const size_t n = sideCount();
    std::vector<size_t> ends(n + 1, 0);
    tbb::parallel_for(size_t(0), n, [&](size_t i) {
        std::vector<std::pair<uint32_t, uint16_t>> row;
        for (size_t k = begin[i]; k < begin[i + 1]; ++k)
            row.emplace_back(entries.side[k], entries.lines[k]);
        std::sort(row.begin(), row.end());
        size_t at = begin[i];
        for (const auto& [side, lines] : row) {
            if (at > begin[i] && entries.side[at - 1] == side &&
                entries.lines[at - 1] + lines <= kMostLines) {
                entries.lines[at - 1] = uint16_t(entries.lines[at - 1] + lines);
            } else {
                entries.side[at] = side;
                entries.lines[at++] = lines;
            }
        }
        ends[i + 1] = at - begin[i];
    });
    std::partial_sum(ends.begin(), ends.end(), ends.begin());
    Entries joined{uninitialised<uint32_t>(ends[n]), uninitialised<uint16_t>(ends[n])};
    tbb::parallel_for(size_t(0), n, [&](size_t i) {
        std::copy_n(entries.side.get() + begin[i], ends[i + 1] - ends[i],
                    joined.side.get() + ends[i]);
        std::copy_n(entries.lines.get() + begin[i], ends[i + 1] - ends[i],
                    joined.lines.get() + ends[i]);
    });
    begin = std::move(ends);
    entries = std::move(joined);
}

}  // namespace raybundle
