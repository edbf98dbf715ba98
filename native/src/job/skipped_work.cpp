// SPDX-License-Identifier: GPL-3.0-or-later
#include "job/skipped_work.h"

#include <cstddef>
#include <iterator>

namespace raybundle {
namespace {

// Texts of the report, in the order of SkippedWork.
constexpr SkippedText kTexts[] = {
    {"EXCHANGE_WITHOUT_LIGHT", "bundles and solve", "there is no light to exchange"},
    {"EXCHANGE_WITHOUT_REFLECTION", "bundles and solve", "no surface reflects light"},
    {"UNCHANGED_GEOMETRY", "patches and lines", "geometry unchanged since the last bake"},
    {"UNCHANGED_LIGHTS", "first shot", "lights unchanged since the last bake"},
    {"SCALED_LIGHTS", "first shot",
     "only strengths of lights changed since the last bake: what each brought is scaled"},
    {"DEGENERATE_FACES", "faces", "no area but for rounding"},
    {"SHEETS", "projection of faces",
     "they lie in a plane with others like them: projected as one"},
    {"UNWANTED_CORNERS", "corners", "their light is not asked for"},
    {"CLUSTERED_PATCHES", "patches",
     "not shown and finer than light is exchanged by: they exchange it as clusters"},
    {"LAMP_INSIDES", "emission", "inside of closed surfaces that hold nothing else"},
    {"FACING_AWAY", "shadow rays", "side and source face away from each other"},
    {"WHOLLY_LIT", "noise of direct light", "source wholly visible: closed form"},
    {"WEAK_SOURCES", "most shadow rays", "the source gives little of the light"},
    {"INSIDE_OF_SOLIDS", "most shadow rays", "the side is the inside of a solid"},
    {"STAND_INS", "shadow rays",
     "sides finer than tiles that are not shown: others stand for them"},
    {"BRIGHT_SPOTS", "bundles", "few bright sides: their reflected light is gathered"},
    {"RAYED_SIDES", "bundles", "few lines would meet what is noisy: its sides cast rays"},
    {"STARVED_SIDES", "bundles on small patches",
     "too few lines met them: they gathered with local rays"},
    {"REACHED_TARGET", "bundles", "the noise is at its target"},
    {"WARM_STARTS", "iterations of a solve", "it starts from the last solution"},
    {"SMOOTH_CORNERS", "final gather", "corners whose light interpolation follows"},
    {"SPARSE_CORNERS", "light on patches", "corners with a result are few: they gather it"},
    {"OCCLUDERS", "reconstruction", "objects that only occlude"},
};
static_assert(std::size(kTexts) == size_t(SkippedWork::OCCLUDERS) + 1);

}  // namespace

const SkippedText& textOf(SkippedWork work) { return kTexts[size_t(work)]; }

}  // namespace raybundle
