// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/line_rows.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "job/cancellation.h"

namespace raybundle {
namespace {

// Rows are processed in blocks of 2^kBlockBits rows. A block is the unit of parallel work.
constexpr uint32_t kBlockBits = 8;
// Largest m and e in a number of lines m * 8^e.
constexpr uint32_t kMostM = 31, kMostE = 7;
// Number of rows that repetition() examines, and the factor of its growth at which entries are
// joined.
constexpr size_t kSampledRows = 64;
constexpr double kMostRepetition = 2;

// Returns an array without the zeros that a vector would write first.
template <class T>
std::unique_ptr<T[]> uninitialised(size_t n) {
    return std::unique_ptr<T[]>(new T[n]);
}

// Calls visit(entry) for the entries that represent a number of lines to a side.
template <class Visit>
void encode(uint32_t side, uint64_t lines, const Visit& visit) {
    while (lines > 0) {
        uint32_t e = 0;
        while (e < kMostE && lines >> (3 * e) > kMostM) ++e;
        const uint32_t m = uint32_t(std::min<uint64_t>(lines >> (3 * e), kMostM));
        visit(side << 8 | e << 5 | m);
        lines -= uint64_t(m) << (3 * e);
    }
}

// Calls visit(row, entry) for the entries of a bundle.
template <class Visit>
void forEachEntry(const BundleLines& bundle, const Visit& visit) {
    bundle.forEachExchange([&](const Exchange& e, uint32_t weight) {
        const uint64_t lines = uint64_t(e.lines) * weight;
        if (lines <= kMostM) {  // nearly always
            visit(e.i, e.j << 8 | uint32_t(lines));
            visit(e.j, e.i << 8 | uint32_t(lines));
            return;
        }
        encode(e.j, lines, [&](uint32_t entry) { visit(e.i, entry); });
        encode(e.i, lines, [&](uint32_t entry) { visit(e.j, entry); });
    });
}

}  // namespace

LineRows::LineRows(size_t sideCount)
    : begin(sideCount + 1, 0), entries(uninitialised<uint32_t>(0)), marks(1, 0) {}

size_t LineRows::byteCount() const {
    return entryCount() * sizeof(uint32_t) + begin.size() * sizeof(begin[0]) +
           marks.size() * sizeof(marks[0]);
}

std::vector<uint32_t> LineRows::append(const std::vector<const BundleLines*>& bundles) {
    // Sort the entries by block, in the order of the bundles.
    const size_t n = sideCount(), blocks = (n >> kBlockBits) + 1;
    std::vector<std::vector<size_t>> places(bundles.size(), std::vector<size_t>(blocks, 0));
    parallelFor(size_t(0), bundles.size(), [&](size_t b) {
        forEachEntry(*bundles[b], [&](uint32_t row, uint32_t) { ++places[b][row >> kBlockBits]; });
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
    const auto entryOf = uninitialised<uint32_t>(place);
    const auto rowOf = uninitialised<uint8_t>(place);  // within the block
    parallelFor(size_t(0), bundles.size(), [&](size_t b) {
        forEachEntry(*bundles[b], [&](uint32_t row, uint32_t entry) {
            const size_t at = places[b][row >> kBlockBits]++;
            entryOf[at] = entry;
            rowOf[at] = uint8_t(row & ((1u << kBlockBits) - 1));
        });
    });
    auto forEachBlock = [&](const auto& body) {
        parallelFor(size_t(0), blocks, [&](size_t block) {
            body(blockBegin[block], blockBegin[block + 1], block << kBlockBits,
                 std::min(n, (block + 1) << kBlockBits));
        });
    };

    // Append the new entries to the existing entries of their rows.
    std::vector<size_t> ends(n + 1, 0);
    std::vector<uint32_t> got(n, 0);
    const LinesOf<uint32_t>& lines = linesOf<uint32_t>();
    forEachBlock([&](size_t first, size_t last, size_t firstRow, size_t lastRow) {
        for (size_t k = first; k < last; ++k) {
            ++ends[firstRow + rowOf[k] + 1];
            got[firstRow + rowOf[k]] += lines[entryOf[k] & 255];
        }
        for (size_t row = firstRow; row < lastRow; ++row)
            ends[row + 1] += begin[row + 1] - begin[row];
    });
    std::partial_sum(ends.begin(), ends.end(), ends.begin());
    auto joined = uninitialised<uint32_t>(ends[n]);
    forEachBlock([&](size_t first, size_t last, size_t firstRow, size_t lastRow) {
        std::vector<size_t> next(lastRow - firstRow);
        for (size_t row = firstRow; row < lastRow; ++row) {
            const size_t count = begin[row + 1] - begin[row];
            std::copy_n(entries.get() + begin[row], count, joined.get() + ends[row]);
            next[row - firstRow] = ends[row] + count;
        }
        for (size_t k = first; k < last; ++k) joined[next[rowOf[k]]++] = entryOf[k];
    });
    begin = std::move(ends);
    entries = std::move(joined);
    if (repetition() > kMostRepetition * leastRepetition) {
        joinRepeated();
        leastRepetition = repetition();
    }
    mark();
    return got;
}

uint32_t LineRows::linesBefore(size_t entry) const {
    const LinesOf<uint32_t>& lines = linesOf<uint32_t>();
    uint32_t sum = marks[entry / kMark];
    for (size_t k = entry / kMark * kMark; k < entry; ++k) sum += lines[entries[k] & 255];
    return sum;
}

void LineRows::mark() {
    const LinesOf<uint32_t>& lines = linesOf<uint32_t>();
    marks.assign(entryCount() / kMark + 1, 0);
    parallelFor(size_t(1), marks.size(), [&](size_t m) {
        for (size_t k = (m - 1) * kMark; k < m * kMark; ++k) marks[m] += lines[entries[k] & 255];
    });
    std::partial_sum(marks.begin(), marks.end(), marks.begin());
}

double LineRows::repetition() const {
    size_t all = 0, different = 0;
    const size_t rows = std::min(sideCount(), kSampledRows);
    std::vector<uint32_t> sides;
    // Pick a random row from each step, since rows at equal distances could all be fronts, for
    // example those of closed boxes.
    std::mt19937_64 random;
    for (size_t s = 0; s < rows; ++s) {
        const size_t first = s * sideCount() / rows, last = (s + 1) * sideCount() / rows;
        const size_t i = first + random() % (last - first);
        sides.clear();
        for (size_t k = begin[i]; k < begin[i + 1]; ++k) sides.push_back(sideOf(entries[k]));
        std::sort(sides.begin(), sides.end());
        all += sides.size();
        different += size_t(std::unique(sides.begin(), sides.end()) - sides.begin());
    }
    return different > 0 ? double(all) / double(different) : 1;
}

void LineRows::joinRepeated() {
    const size_t n = sideCount(), blocks = (n >> kBlockBits) + 1;
    const LinesOf<uint32_t>& lines = linesOf<uint32_t>();
    // Per thread: 1 plus the index of each side in the current row.
    tbb::enumerable_thread_specific<std::vector<uint32_t>> places(std::vector<uint32_t>(n, 0));
    std::vector<std::vector<uint32_t>> joinedOf(blocks);
    std::vector<size_t> ends(n + 1, 0);
    parallelFor(size_t(0), blocks, [&](size_t block) {
        std::vector<uint32_t>& place = places.local();
        std::vector<uint32_t>& joined = joinedOf[block];
        std::vector<std::pair<uint32_t, uint64_t>> row;  // side, lines
        for (size_t i = block << kBlockBits; i < std::min(n, (block + 1) << kBlockBits); ++i) {
            row.clear();
            for (size_t k = begin[i]; k < begin[i + 1]; ++k) {
                const uint32_t side = sideOf(entries[k]);
                if (!place[side]) {
                    row.emplace_back(side, 0);
                    place[side] = uint32_t(row.size());
                }
                row[place[side] - 1].second += lines[entries[k] & 255];
            }
            const size_t before = joined.size();
            for (const auto& [side, count] : row) {
                place[side] = 0;
                encode(side, count, [&](uint32_t entry) { joined.push_back(entry); });
            }
            ends[i + 1] = joined.size() - before;
        }
    });
    std::partial_sum(ends.begin(), ends.end(), ends.begin());
    entries = uninitialised<uint32_t>(ends[n]);
    parallelFor(size_t(0), blocks, [&](size_t block) {
        if (!joinedOf[block].empty())
            std::copy(joinedOf[block].begin(), joinedOf[block].end(),
                      entries.get() + ends[block << kBlockBits]);
    });
    begin = std::move(ends);
}

}  // namespace raybundle
