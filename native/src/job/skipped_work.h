// SPDX-License-Identifier: GPL-3.0-or-later
//
// Work that a bake has left out, as stated in its report: an identifier for programs and tests,
// what was left out, and the condition that made leaving it out safe.
#pragma once

#include <cstdint>

namespace raybundle {

// Kinds of work that a bake can leave out. Their names are identifiers of the report
// (docs/c_api.md): the meaning of a released name never changes.
enum class SkippedWork {
    EXCHANGE_WITHOUT_LIGHT,
    EXCHANGE_WITHOUT_REFLECTION,
    UNCHANGED_GEOMETRY,
    UNCHANGED_LIGHTS,
    SCALED_LIGHTS,
    KEPT_LIGHTS,
    SCALED_DRAFT,
    SECOND_PASS,
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
    DENSE_NODES,
    OCCLUDERS
};

// The texts of an entry in the report's list of skipped work. All strings are static.
struct SkippedText {
    const char* id;    // identifier, such as "EXCHANGE_WITHOUT_LIGHT"
    const char* what;  // what was left out
    const char* why;   // the condition that made leaving it out safe
};
// Returns the texts of a kind of skipped work. The reference is to static memory.
const SkippedText& textOf(SkippedWork work);

}  // namespace raybundle
