// SPDX-License-Identifier: GPL-3.0-or-later
//
// The exchanges of one half of the bundles, as the rows of a symmetric matrix. The row of a patch
// side holds the other sides of its lines and the numbers of lines.
//
// An entry takes 4 bytes: 24 bits for the other side and 8 bits for the number of lines. Each
// exchange has one entry in the rows of both of its sides. The number of lines is m * 8^e, with m
// in 5 bits and e in 3 bits. Few lines, or few lines that stand for 4^n lines each
// (bundles/line_windows.h), are represented exactly by one entry. Other numbers take several
// entries. Rows are in the order of the bundles, and a pair that several bundles found has several
// entries. Since most pairs are found only once (256 bundles of cornell_box give 1.23 entries per
// pair), a search for equal ones would cost more than it saves. Entries of equal pairs are joined
// when there are twice as many entries as needed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "bundles/projector.h"

namespace raybundle {

// Rows of a sparse symmetric matrix of line counts.
class LineRows {
  public:
    // `sideCount` must be at most 2^24.
    explicit LineRows(size_t sideCount);

    // Appends the exchanges of some bundles. Returns the number of these lines per side.
    std::vector<uint32_t> append(const std::vector<const BundleLines*>& bundles);

    // Returns the side of an entry. The entry's number of lines is linesOf()[entry & 255].
    static uint32_t sideOf(uint32_t entry) { return entry >> 8; }
    template <class Number>
    using LinesOf = std::array<Number, 256>;  // indexed by entry & 255
    template <class Number>
    // Returns the table of the numbers of lines.
    static const LinesOf<Number>& linesOf();

    // Return the range of the entries of row i.
    const uint32_t* first(uint32_t i) const { return entries.get() + begin[i]; }
    const uint32_t* last(uint32_t i) const { return entries.get() + begin[i + 1]; }

    // Visits entries of row i that represent all of its lines, by visit(side, lines). Visits all
    // entries if there are at most `enough`. Otherwise the lines of the row are divided into
    // `enough` equal steps, and the entry of one line in each step is visited; within(step) returns
    // the position of this line in the step, in [0, 1). (Visiting entries at equal distances
    // instead would give an entry with a third of all lines either nearly all of the weight or
    // none.)
    template <class Within, class Visit>
    void visitSome(uint32_t i, size_t enough, const Within& within, const Visit& visit) const;

    // Returns the number of entries of all rows.
    size_t entryCount() const { return begin.back(); }
    size_t byteCount() const;

  private:
    size_t sideCount() const { return begin.size() - 1; }
    // Returns the number of entries of a row over the number of different sides in it, estimated
    // from some of the rows.
    double repetition() const;
    // Joins the entries of equal sides in each row.
    void joinRepeated();
    // Computes `marks`.
    void mark();
    // Returns the number of lines of all entries before an entry, modulo 2^32.
    uint32_t linesBefore(size_t entry) const;

    // Per side: index of its first entry; one more value at the end.
    std::vector<size_t> begin;
    std::unique_ptr<uint32_t[]> entries;
    static constexpr size_t kMark = 64;
    std::vector<uint32_t> marks;  // linesBefore() of each kMark-th entry
    double leastRepetition = 1;   // repetition() after the last joining
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
    uint32_t before = 0;  // number of lines of the row before entry `at`
    int steps = 0;        // number of steps that fall into entry `at`
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
