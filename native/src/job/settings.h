// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "job/choices.h"
#include "job/skips.h"

namespace raybundle {

// Largest number of patches. A side is stored in 24 bits (bundles/line_rows.h), and a patch has
// two.
constexpr size_t kMostPatches = size_t(1) << 23;
// Windows of finer lines for small patches (bundles/line_windows.h) are limited such that the line
// counts can hold about this many bundles. If maxBundles is larger, there are no windows.
constexpr int kMostWindowBundles = 1 << 16;

// The settings of a bake. This struct is the only place that holds their default values. The
// meaning, the name in the C interface, the range and the unit of each are in job/setting_table.h.
// An int with the range 0 to 1 is a switch.
struct Settings : Skips {
    float targetError = 0.02f;
    float patchSize = 0;
    int maxPatches = 100000;
    int refine = 0;
    int contacts = 1;
    int adaptMeshes = 0;
    int maxVertices = 100000;
    int discontinuityLines = 1;
    int countAdaptive = 0;
    int draft = 0;
    int minBundles = 64;
    int maxBundles = kMostWindowBundles;
    int linesPerBundle = 0;
    float memoryLimit = 0;
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

    // Set or get the setting `name` of job/setting_table.h. The value of a choice is passed as its
    // name; the returned name is static. All throw Error(INVALID_ARGUMENT) if there is no setting
    // of this name and type. The setters also throw if the value is out of range.
    void set(const std::string& name, int value);
    void set(const std::string& name, float value);
    void set(const std::string& name, const std::string& value);
    void get(const std::string& name, int& value) const;
    void get(const std::string& name, float& value) const;
    const char* get(const std::string& name) const;

    // Returns whether the solver keeps the lines of all bundles as counts (SolverCan::COUNT_LINES).
    bool countsLines() const { return can(solver, SolverCan::COUNT_LINES); }
    // Returns whether sides gather the light of the sources. Otherwise the sources send rays to
    // sides.
    bool gathersFirstShot() const { return rowOf(firstShot).isGathered; }
    // Returns whether lines may be denser where patches are small, in windows of finer pixels.
    bool hasLineWindows() const {
        return countsLines() && isProjectionExact() && linesPerBundle == 0 &&
               maxBundles <= kMostWindowBundles;
    }
    // Returns whether the direction of each bundle is independent of the previous ones.
    bool hasIndependentDirections() const { return rowOf(directions).isIndependent; }
    // Returns whether the projector finds all surfaces along a line, in order.
    bool isProjectionExact() const {
        return rowOf(projector).isExact && smallPatches == SmallPatches::CENTRE_SAMPLING &&
               linesPerBundle != 1;
    }
};

}  // namespace raybundle
