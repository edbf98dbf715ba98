// SPDX-License-Identifier: GPL-3.0-or-later
//
// The line counts of all bundles traced so far: how many lines join two patch sides (c_ij,
// symmetric), how many leave the scene from a side (the sky column), and how many leave a side in
// all (m_i). c_ij / m_i estimates the form factor F_ij (thesis section 2.3.2, eq. 2.30).
//
// Differs from the thesis: lines that leave the scene count in m_i. The two independent halves of
// the bundles are counted apart for the error estimate, each in rows of its own, so that a solve on
// one half reads nothing of the other. Counts are integers, in the order of the bundles, so that
// the result does not depend on the number of threads. Where lines have several densities
// (bundles/line_windows.h), counts are in lines of the finest one.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bundles/bundle_tracer.h"
#include "bundles/line_rows.h"

namespace raybundle {

// What joins a side with another one.
struct LineCount {
    uint32_t side;                  // the other end
    std::array<uint32_t, 2> lines;  // per half

    bool operator==(const LineCount& o) const { return side == o.side && lines == o.lines; }
    bool operator!=(const LineCount& o) const { return !(*this == o); }
};

class LineCounts {
  public:
    explicit LineCounts(size_t sideCount);

    // Adds the lines of some bundles.
    void add(const std::vector<TracedBundle>& traced);

    // Counts lines per side alone: sky, total and touching.
    void addTotals(const std::vector<TracedBundle>& traced);

    // Frees the matrix; what is counted per side stays.
    void dropExchanges();

    size_t sideCount() const { return sky.size(); }
    // Pairs that are kept; those that are found again may be kept again.
    size_t exchangeCount() const { return (halves[0].entryCount() + halves[1].entryCount()) / 2; }
    size_t byteCount() const;

    // The rows of a half.
    const LineRows& rows(size_t half) const { return halves[half]; }
    // Row i of the symmetric matrix, ordered by the other side, each once. Takes its time.
    std::vector<LineCount> row(uint32_t i) const;

    // The share of each side that does not lie against another surface: 0 to 1, and 1 without
    // lines. As it was measured, else as the lines tell it.
    std::vector<float> exposedShare() const;
    // Those sides that lines tell to be covered in part and that were not measured.
    std::vector<uint32_t> coveredInPart() const;
    void setExposedShare(uint32_t side, float share) { measured[side] = share; }

    // Whether some lines stand for several of the finest ones.
    bool hasDensities() const { return !met.empty(); }

    // Lines of a side that ended on others or left the scene, each counted once whatever its
    // density: how much the counts of that side can be trusted.
    double linesMet(uint32_t side) const;
    // The same with those that ended where it is covered.
    uint32_t linesMetInAll(uint32_t side) const {
        return met.empty() ? total[side][0] + total[side][1] + touching[side] : met[side];
    }

    std::vector<std::array<uint32_t, 2>> sky;    // per side and half: lines that leave the scene
    std::vector<std::array<uint32_t, 2>> total;  // per side and half: m_i
    std::vector<uint32_t> touching;              // per side: lines that end where it is covered
    uint32_t bundles = 0;                        // whose lines are in

  private:
    void countMet(const std::vector<TracedBundle>& traced);

    std::array<LineRows, 2> halves;
    std::vector<uint32_t> met;    // per side: linesMetInAll, if lines have several densities
    std::vector<float> measured;  // per side: exposed share, below 0 where it was not measured
};

}  // namespace raybundle
