// SPDX-License-Identifier: GPL-3.0-or-later
//
// Work that a bake has left out, as its report says it: an identifier for programs and tests, what
// was left out, and the condition that made that safe.
#pragma once

#include <cstdint>

namespace raybundle {

// The identifiers are part of the report (docs/c_api.md): once released, none changes its meaning.
enum class SkippedWork {
    EXCHANGE_WITHOUT_LIGHT,
    EXCHANGE_WITHOUT_REFLECTION,
    UNCHANGED_GEOMETRY,
    UNCHANGED_LIGHTS,
    SCALED_LIGHTS,
    DEGENERATE_FACES,
    SHEETS,
    UNWANTED_CORNERS,
    CLUSTERED_PATCHES,
    LAMP_INSIDES,
    FACING_AWAY,
    WHOLLY_LIT,
    WEAK_SOURCES,
    INSIDE_OF_SOLIDS,
    STAND_INS,
    BRIGHT_SPOTS,
    RAYED_SIDES,
    STARVED_SIDES,
    REACHED_TARGET,
    WARM_STARTS,
    SMOOTH_CORNERS,
    SPARSE_CORNERS,
    OCCLUDERS
};

// One line of the report's list of what was skipped. Static memory.
struct SkippedText {
    const char* id;    // "EXCHANGE_WITHOUT_LIGHT" and so on
    const char* what;  // what was left out
    const char* why;   // the condition that made that safe
};
const SkippedText& textOf(SkippedWork work);

}  // namespace raybundle
