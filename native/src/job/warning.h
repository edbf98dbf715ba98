// SPDX-License-Identifier: GPL-3.0-or-later
//
// What a bake warns of: an identifier for programs and tests, and a sentence for the user that
// names the object concerned and says what to do.
#pragma once

#include <string>
#include <vector>

namespace raybundle {

// The identifiers are part of the report (docs/c_api.md): once released, none changes its meaning.
enum class WarningId {
    CLAMPED_REFLECTANCE,
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
    COARSE_MESH
};

// The identifier as the report has it, "CLAMPED_REFLECTANCE" and so on. Static memory.
const char* nameOf(WarningId id);

struct Warning {
    WarningId id;
    std::string text;  // UTF-8, for the user
};
using Warnings = std::vector<Warning>;

}  // namespace raybundle
