// SPDX-License-Identifier: GPL-3.0-or-later
//
// The warnings of a bake: an identifier for programs and tests, and a sentence for the user that
// names the object concerned and states what to do.
#pragma once

#include <string>
#include <vector>

namespace raybundle {

// Kinds of warnings. Their names are identifiers of the report (docs/c_api.md): the meaning of a
// released name never changes.
enum class WarningId {
    CLAMPED_REFLECTANCE,
    BLACK_PIXELS,
    DEGENERATE_FACES,
    DOUBLED_FACES,
    UNCUT_CROSSINGS,
    FEWER_THREADS,
    NO_FACES,
    NO_LIGHT,
    DARK_LIGHT_SET,
    BLOCKS_AS_THE_WORLD,
    NO_EXCHANGE,
    NO_TRANSLUCENCE,
    NO_ANGLES,
    UNCUT_GAPS,
    FEW_LINES,
    DIRECT_NOISE,
    MAX_BUNDLES,
    UNCOUNTABLE_LINES,
    MEMORY_LIMIT,
    BROKEN_CYCLES,
    WRONG_EXCHANGES,
    UNSETTLED_EXCHANGE,
    ENERGY_BALANCE,
    UNSOLVED_FIT,
    NO_LIGHT_ON_SIDE,
    NOISY_OBJECTS,
    COARSE_MESH,
    MAX_VERTICES,
    MAX_PATCHES
};

// Returns the identifier as it is in the report, such as "CLAMPED_REFLECTANCE". The string is
// static.
const char* nameOf(WarningId id);

// A warning of a bake.
struct Warning {
    WarningId id;
    std::string text;  // UTF-8, for the user
};
using Warnings = std::vector<Warning>;

}  // namespace raybundle
