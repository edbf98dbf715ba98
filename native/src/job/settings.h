// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "job/skips.h"

namespace raybundle {

// The number of a side takes 24 bits (bundles/line_rows.h).
constexpr size_t kMostPatches = size_t(1) << 23;
// Where small patches have finer lines (bundles/line_windows.h), at least about so many bundles can
// be counted.
constexpr int kMostWindowBundles = 1 << 16;

enum class SmallPatches { CENTRE_SAMPLING, ROULETTE };
enum class PlanePlacement { STRATIFIED, SYSTEMATIC, CLOSE_DISTANCE };

// What methods can be combined with a sequence of directions (bundles/directions.h) follows from
// this.
struct DirectionMethod {
    const char* name;    // a value of Settings::directions
    bool isIndependent;  // each direction is independent of those before
    bool isWeighted;     // directions have weights other than 1
};
const std::vector<DirectionMethod>& directionMethods();

// Settings of a bake and, in this one place, their defaults. Settable by name (see raybundle.h).
struct Settings : Skips {
    float targetError = 0.02f;  // relative noise at which bundles stop
    float patchSize = 0;        // metres; 0 = automatic
    int maxPatches = 100000;
    int refine = 0;    // 1: patches smaller than patchSize where that pays
    int contacts = 1;  // 1: patches smaller than patchSize beside narrow gaps
    int minBundles = 64;
    int maxBundles = kMostWindowBundles;
    int linesPerBundle = 0;    // 0 = automatic
    float memoryLimit = 4096;  // of the exchanges, MB
    int seed = 0;
    int threads = 0;                // 0 = all
    float regularization = 0.005f;  // of the reconstruction
    std::string solver = "LINE_REUSE";
    std::string firstShot = "GATHER";
    std::string directions = "LOW_DISCREPANCY";
    std::string projector = "AUTO";
    std::string smallPatches = "CENTRE_SAMPLING";
    std::string reconstruction = "LEAST_SQUARES";
    int finalGather = 1;  // of POINT and sparse results; 0: other surfaces' light is interpolated
    int planeCount = 4;   // of the projector PLANES
    std::string planePlacement = "SYSTEMATIC";
    int planeCoherence = 1;               // 0: makes the planes' depth buffers one by one
    int localRays = 0;                    // of a first shot that shoots; 0 = to targetError
    std::string estimator = "COLLISION";  // of RANDOM_WALK
    int thesisLiteral = 0;  // 1: MULTIPATH as the thesis' pseudo-code says, for comparison

    // Throw Error(INVALID_ARGUMENT) for unknown names, other types, and values out of range.
    void set(const std::string& name, int value);
    void set(const std::string& name, float value);
    void set(const std::string& name, const std::string& value);
    void get(const std::string& name, int& value) const;
    void get(const std::string& name, float& value) const;
    const std::string& get(const std::string& name) const;

    SmallPatches smallPatchesKind() const {
        return smallPatches == "ROULETTE" ? SmallPatches::ROULETTE : SmallPatches::CENTRE_SAMPLING;
    }
    PlanePlacement planePlacementKind() const;
    // Whether lines may be denser where patches are small.
    bool hasLineWindows() const {
        return solver == "LINE_REUSE" && isProjectionExact() && linesPerBundle == 0 &&
               maxBundles <= kMostWindowBundles;
    }
    // Whether each bundle's direction is independent of those before.
    bool hasIndependentDirections() const;
    // Whether the projector sees all surfaces along a line.
    bool isProjectionExact() const {
        return (projector == "AUTO" || projector == "FRAGMENT_LISTS") &&
               smallPatches == "CENTRE_SAMPLING" && linesPerBundle != 1;
    }
};

}  // namespace raybundle
