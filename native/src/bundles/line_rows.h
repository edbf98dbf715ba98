// SPDX-License-Identifier: GPL-3.0-or-later
//
// The exchanges of one half of the bundles as the rows of a symmetric matrix: for each patch side,
// the sides that lines join it with, and how many lines.
//
// An entry takes 6 bytes, and each exchange has one in the row of either end. Rows are in the order
// of the bundles, and a pair that several bundles found has several entries: most pairs are found
// once (256 bundles of cornell_box leave 1.23 entries a pair), so that looking for equal ones costs
// more than it saves. They are joined when every other entry is a repetition.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "bundles/projector.h"

namespace raybundle {

class LineRows {
  public:
    explicit LineRows(size_t sideCount);

    // Appends the exchanges of some bundles. Returns how many of their lines each side has.
    std::vector<uint32_t> append(const std::vector<const BundleLines*>& bundles);

    // Calls visit(other side, lines) for the entries of row i.
    template <class Visit>
    void forEach(uint32_t i, const Visit& visit) const {
        for (size_t k = begin[i]; k < begin[i + 1]; ++k)
            visit(entries.side[k], uint32_t(entries.lines[k]));
    }

    // Of all rows.
    size_t entryCount() const { return begin.back(); }
    size_t byteCount() const;

  private:
    // Apart, since together they would be padded to 8 bytes.
    struct Entries {
        std::unique_ptr<uint32_t[]> side;
        std::unique_ptr<uint16_t[]> lines;
    };

    size_t sideCount() const { return begin.size() - 1; }
    // Entries of a row over the different sides in it, by some of the rows.
    double repetition() const;
    void joinRepeated();

    std::vector<size_t> begin;  // per side, into the entries; one more at the end
    Entries entries;
};

}  // namespace raybundle
