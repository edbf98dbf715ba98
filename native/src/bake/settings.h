// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>

#include "bundles/directions.h"

namespace raybundle {

// Settings of a bake and, in this one place, their defaults. Settable by name (see raybundle.h).
struct Settings {
    float targetError = 0.02f;  // relative noise at which bundles stop
    float patchSize = 0;        // metres; 0 = automatic
    int maxPatches = 100000;
    int minBundles = 64;
    int maxBundles = 4096;
    int linesPerBundle = 0;    // 0 = automatic
    float memoryLimit = 4096;  // of the exchanges, MB
    int seed = 0;
    int threads = 0;               // 0 = all
    float regularization = 0.02f;  // of the reconstruction
    std::string solver = "LINE_REUSE";
    std::string firstShot = "GATHER";
    std::string directions = "LOW_DISCREPANCY";
    std::string projector = "AUTO";
    std::string smallPatches = "CENTRE_SAMPLING";
    std::string reconstruction = "LEAST_SQUARES";

    // Throw Error(INVALID_ARGUMENT) for unknown names, other types, and values out of range.
    void set(const std::string& name, int value);
    void set(const std::string& name, float value);
    void set(const std::string& name, const std::string& value);
    void get(const std::string& name, int& value) const;
    void get(const std::string& name, float& value) const;
    const std::string& get(const std::string& name) const;

    DirectionKind directionKind() const {
        return directions == "RANDOM" ? DirectionKind::RANDOM : DirectionKind::LOW_DISCREPANCY;
    }
};

}  // namespace raybundle
