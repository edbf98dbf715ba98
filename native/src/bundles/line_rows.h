// SPDX-License-Identifier: GPL-3.0-or-later
//
// The exchanges of one half of the bundles as the rows of a symmetric matrix: for each patch side,
// the sides that lines join it with, and how many lines.
//
// An entry takes 4 bytes, 24 bits of them the other side and 8 the number of lines, and each
// exchange has one in the row of either end. The number is m * 8^e with m in 5 bits and e in 3: few
// lines fit exactly, and so do few lines that stand for 4^n each (bundles/line_windows.h); others
// take several entries. Rows are in the order of the bundles, and a pair that several bundles found
// has several entries: most pairs are found once (256 bundles of cornell_box leave 1.23 entries a
// pair), so that looking for equal ones costs more than it saves. They are joined when there are
// twice as many entries as needed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "bundles/projector.h"

namespace raybundle {

class LineRows {
  public:
    // sideCount: at most 2^24.
    explicit LineRows(size_t sideCount);

    // Appends the exchanges of some bundles. Returns how many of their lines each side has.
    std::vector<uint32_t> append(const std::vector<const BundleLines*>& bundles);

    // An entry: its side, and its lines by this table.
    static uint32_t sideOf(uint32_t entry) { return entry >> 8; }
    template <class Number>
    using LinesOf = std::array<Number, 256>;  // by entry & 255
    template <class Number>
    static const LinesOf<Number>& linesOf();

    // The entries of row i.
    const uint32_t* first(uint32_t i) const { return entries.get() + begin[i]; }
    const uint32_t* last(uint32_t i) const { return entries.get() + begin[i + 1]; }

    // Visits entries of row i that stand for all of its lines: visit(side, lines). All entries if
    // there are no more than `enough`; else those of one line of each of so many equal steps
    // through the lines of the row: within(step) says where in a step, 0 to 1 (less). (Of each so
    // many-th entry, one that has a third of all lines would count for nearly all, or not at all.)
    template <class Within, class Visit>
    void visitSome(uint32_t i, size_t enough, const Within& within, const Visit& visit) const;

    // Of all rows.
    size_t entryCount() const { return begin.back(); }
    size_t byteCount() const;

  private:
    size_t sideCount() const { return begin.size() - 1; }
    // Entries of a row over the different sides in it, by some of the rows.
    double repetition() const;
    void joinRepeated();
    void mark();
    // Lines of all entries before one, modulo 2^32.
    uint32_t linesBefore(size_t entry) const;

    std::vector<size_t> begin;  // per side, into the entries; one more at the end
    std::unique_ptr<uint32_t[]> entries;
    static constexpr size_t kMark = 64;
    std::vector<uint32_t> marks;  // linesBefore each kMark-th entry, and all
    double leastRepetition = 1;   // after the last joining
};

template <class Number>
inline const LineRows::LinesOf<Number>& LineRows::linesOf() {
    static const LinesOf<Number> table = [] {
        LinesOf<Number> lines{};
        for (uint32_t code = 0; code < lines.size(); ++code)
            lines[code] = Number((code & 31u) << (3 * (code >> 5)));
        return lines;
    }();
    return table;
}

template <class Within, class Visit>
inline void LineRows::visitSome(uint32_t i, size_t enough, const Within& within,
                                const Visit& visit) const {
    const LinesOf<uint32_t>& lines = linesOf<uint32_t>();
    const size_t first = begin[i], last = begin[i + 1];
    if (last - first <= enough) {
        for (size_t k = first; k < last; ++k)
            visit(sideOf(entries[k]), float(lines[entries[k] & 255]));
        return;
    }
    const uint32_t start = linesBefore(first);
    const double step = double(linesBefore(last) - start) / double(enough);
    size_t at = first;
    uint32_t before = 0;  // lines of the row before entry `at`
    int steps = 0;        // of entry `at`
    for (size_t s = 0; s < enough; ++s) {
        const auto line = uint32_t(step * (double(s) + within(s)));
        if (line - before < lines[entries[at] & 255]) {
            ++steps;
            continue;
        }
        if (steps > 0) visit(sideOf(entries[at]), float(steps * step));
        for (size_t m = at / kMark + 1; m * kMark < last && marks[m] - start <= line; ++m) {
            at = m * kMark;
            before = marks[m] - start;
        }
        for (; line - before >= lines[entries[at] & 255]; ++at) before += lines[entries[at] & 255];
        steps = 1;
    }
    visit(sideOf(entries[at]), float(steps * step));
}

}  // namespace raybundle
