// SPDX-License-Identifier: GPL-3.0-or-later
#include "job/skipped_work.h"

#include <cstddef>
#include <iterator>

namespace raybundle {
namespace {

// Texts of the report, in the order of SkippedWork.
constexpr SkippedText kTexts[] = {
    {"EXCHANGE_WITHOUT_LIGHT", "bundles and solve", "no light reaches any surface"},
    {"EXCHANGE_WITHOUT_REFLECTION", "bundles and solve",
     "no surface reflects light, and lines carry no other light"},
    {"UNCHANGED_GEOMETRY", "patches and lines", "the geometry is unchanged since the last bake"},
    {"UNCHANGED_LIGHTS", "first shot", "the lights are unchanged since the last bake"},
    {"SCALED_LIGHTS", "first shot",
     "only the strengths of lights have changed since the last bake; their light was scaled"},
    {"KEPT_LIGHTS", "first shot",
     "these lights are as before, or have only changed their strengths; only the others were "
     "gathered"},
    {"SCALED_DRAFT", "all stages",
     "nothing or only the strengths of lights have changed since the last draft; its light was "
     "scaled"},
    {"SECOND_PASS", "the second pass", "no mesh needed more vertices for its light"},
    {"DEGENERATE_FACES", "faces", "their area is zero or no larger than rounding errors"},
    {"SHEETS", "projection of faces",
     "neighbouring faces of equal shape in one plane were projected together"},
    {"UNWANTED_CORNERS", "corners", "no result is needed there"},
    {"CLUSTERED_PATCHES", "patches",
     "they are not shown and finer than needed; they exchanged light in clusters"},
    {"LAMP_INSIDES", "emission", "it is inside closed surfaces that contain nothing else"},
    {"FACING_AWAY", "shadow rays", "the side and the source cannot face each other"},
    {"WHOLLY_LIT", "noise of direct light",
     "the source is fully visible; a closed form gives its light"},
    {"WEAK_SOURCES", "most shadow rays", "the source contributes little of the light"},
    {"INSIDE_OF_SOLIDS", "most shadow rays", "the side is the inside of a solid"},
    {"STAND_INS", "shadow rays",
     "the sides are not shown and finer than tiles; other sides gathered for them"},
    {"BRIGHT_SPOTS", "bundles", "the light that a few bright sides reflect was gathered instead"},
    {"RAYED_SIDES", "bundles", "few lines meet the noisy sides; these sides cast rays instead"},
    {"STARVED_SIDES", "bundles on small patches",
     "too few lines met the patches; they gathered light with local rays"},
    {"REACHED_TARGET", "bundles", "the noise has reached its target"},
    {"WARM_STARTS", "iterations of a solve", "the solve started from the last solution"},
    {"SMOOTH_CORNERS", "final gather", "interpolation gives the light at these corners"},
    {"SPARSE_CORNERS", "light on patches",
     "only few corners need a result; they gathered the light themselves"},
    {"DENSE_NODES", "final gather",
     "the mesh is dense; light from around was gathered at some vertices and interpolated between"},
    {"OCCLUDERS", "reconstruction", "the objects only occlude"},
};
static_assert(std::size(kTexts) == size_t(SkippedWork::OCCLUDERS) + 1);

}  // namespace

const SkippedText& textOf(SkippedWork work) { return kTexts[size_t(work)]; }

}  // namespace raybundle
