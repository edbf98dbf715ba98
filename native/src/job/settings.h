// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "job/choices.h"
#include "job/skips.h"

namespace raybundle {

// The number of a side takes 24 bits (bundles/line_rows.h).
constexpr size_t kMostPatches = size_t(1) << 23;
// Where small patches have finer lines (bundles/line_windows.h), at least about so many bundles can
// be counted.
constexpr int kMostWindowBundles = 1 << 16;

// Settings of a bake and, in this one place, their defaults. What each one means, its name in the C
// interface, its range and unit are in job/setting_table.h; an int of 0 or 1 is a switch.
struct Settings : Skips {
    float targetError = 0.02f;
    float patchSize = 0;
    int maxPatches = 100000;
    int refine = 0;
    int contacts = 1;
    int minBundles = 64;
    int maxBundles = kMostWindowBundles;
    int linesPerBundle = 0;
    float memoryLimit = 4096;
    int seed = 0;
    int threads = 0;
    float regularization = 0.005f;
    Solver solver = Solver::LINE_REUSE;
    FirstShotKind firstShot = FirstShotKind::GATHER;
    DirectionKind directions = DirectionKind::LOW_DISCREPANCY;
    ProjectorKind projector = ProjectorKind::AUTO;
    SmallPatches smallPatches = SmallPatches::CENTRE_SAMPLING;
    Reconstruction reconstruction = Reconstruction::LEAST_SQUARES;
    int finalGather = 1;
    int planeCount = 4;
    PlanePlacement planePlacement = PlanePlacement::SYSTEMATIC;
    int planeCoherence = 1;
    int localRays = 0;
    Estimator estimator = Estimator::COLLISION;
    int thesisLiteral = 0;

    // By the names of the table. Throw Error(INVALID_ARGUMENT) for unknown names, other types, and
    // values out of range. Choices are set and read by the names of their values, which are in
    // static memory.
    void set(const std::string& name, int value);
    void set(const std::string& name, float value);
    void set(const std::string& name, const std::string& value);
    void get(const std::string& name, int& value) const;
    void get(const std::string& name, float& value) const;
    const char* get(const std::string& name) const;

    // Whether the solver keeps the lines of all bundles as counts (SolverCan::COUNT_LINES).
    bool countsLines() const { return can(solver, SolverCan::COUNT_LINES); }
    // Whether the sides gather the light of the sources, rather than being met by rays from them.
    bool gathersFirstShot() const { return rowOf(firstShot).isGathered; }
    // Whether lines may be denser where patches are small.
    bool hasLineWindows() const {
        return countsLines() && isProjectionExact() && linesPerBundle == 0 &&
               maxBundles <= kMostWindowBundles;
    }
    // Whether each bundle's direction is independent of those before.
    bool hasIndependentDirections() const { return rowOf(directions).isIndependent; }
    // Whether the projector sees all surfaces along a line.
    bool isProjectionExact() const {
        return rowOf(projector).isExact && smallPatches == SmallPatches::CENTRE_SAMPLING &&
               linesPerBundle != 1;
    }
};

}  // namespace raybundle
