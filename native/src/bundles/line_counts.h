// SPDX-License-Identifier: GPL-3.0-or-later
//
// The line counts of all bundles traced so far: the number of lines that join two patch sides
// (c_ij, symmetric), the number that leave the scene from a side (the sky column), and the number
// that leave a side in all (m_i). c_ij / m_i estimates the form factor F_ij (thesis section 2.3.2,
// eq. 2.30).
//
// Differs from the thesis:
// - Lines that leave the scene count in m_i.
// - The two independent halves of the bundles are counted separately for the error estimate. Each
//   half has its own rows, so that a solve on one half reads nothing of the other.
// - Counts are integers and are added in the order of the bundles, so that the result does not
//   depend on the number of threads.
// - Where lines have several densities (bundles/line_windows.h), counts are in lines of the finest
//   density.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bundles/bundle_tracer.h"
#include "bundles/line_rows.h"

namespace raybundle {

// An entry of a row of the matrix.
struct LineCount {
    uint32_t side;                  // the other side
    std::array<uint32_t, 2> lines;  // per half: number of lines

    bool operator==(const LineCount& o) const { return side == o.side && lines == o.lines; }
    bool operator!=(const LineCount& o) const { return !(*this == o); }
};

// Sparse symmetric matrix of line counts, and counts per side.
class LineCounts {
  public:
    explicit LineCounts(size_t sideCount);

    // Adds the lines of some bundles to all counts.
    void add(const std::vector<TracedBundle>& traced);

    // Adds the lines of some bundles only to the counts per side (sky, total and touching), not to
    // the matrix.
    void addTotals(const std::vector<TracedBundle>& traced);

    // Frees the matrix. The counts per side remain.
    void dropExchanges();

    size_t sideCount() const { return sky.size(); }
    // Returns the number of stored pairs. A pair found by several bundles may be stored several
    // times.
    size_t exchangeCount() const { return (halves[0].entryCount() + halves[1].entryCount()) / 2; }
    size_t byteCount() const;

    // Returns the rows of a half of the bundles, 0 or 1.
    const LineRows& rows(size_t half) const { return halves[half]; }
    // Returns row i of the symmetric matrix, ordered by the other side, without duplicates. Slow.
    std::vector<LineCount> row(uint32_t i) const;

    // Returns for each side the share of its area that touches no other surface, 0 to 1. The share
    // is the measured one if setExposedShare() was called, otherwise that of the lines. It is 1 for
    // sides without lines.
    std::vector<float> exposedShare() const;
    // Returns the sides that are partly covered according to the lines and have no measured share.
    std::vector<uint32_t> coveredInPart() const;
    // Sets the measured exposed share of a side, 0 to 1.
    void setExposedShare(uint32_t side, float share) { measured[side] = share; }

    // Returns whether some lines stand for several of the finest lines.
    bool hasDensities() const { return !met.empty(); }

    // Returns the number of lines of a side that ended on other sides or left the scene. Each line
    // counts once, whatever its density. The number shows how much the counts of the side can be
    // trusted.
    double linesMet(uint32_t side) const;
    // Returns linesMet() plus the number of lines that ended where the side is covered.
    uint32_t linesMetInAll(uint32_t side) const {
        return met.empty() ? total[side][0] + total[side][1] + touching[side] : met[side];
    }

    // Per side and half: number of lines that leave the scene.
    std::vector<std::array<uint32_t, 2>> sky;
    std::vector<std::array<uint32_t, 2>> total;  // per side and half: m_i
    std::vector<uint32_t> touching;  // per side: number of lines that end where it is covered
    uint32_t bundles = 0;            // number of bundles whose lines were added by add()

  private:
    void countMet(const std::vector<TracedBundle>& traced);

    std::array<LineRows, 2> halves;
    // Per side: linesMetInAll(); empty unless lines have several densities.
    std::vector<uint32_t> met;
    std::vector<float> measured;  // per side: measured exposed share, or below 0
};

}  // namespace raybundle
