// SPDX-License-Identifier: GPL-3.0-or-later
#include "job/combination.h"

#include <algorithm>
#include <string>
#include <vector>

#include "job/error.h"

namespace raybundle {
namespace {

using Names = std::vector<std::string>;

bool contains(const Names& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

// What a solver works with besides every first shot.
struct Solver {
    const char* name;
    bool needsIndependence, needsEqualWeights;  // of directions
    const char* whyDirections;
    Names projectors;
    const char* whyProjectors;
};

const Names kAllProjectors = {"AUTO",           "FRAGMENT_LISTS", "PAINTER",
                              "PAINTER_NEWELL", "PLANE",          "PLANES"};
const Names kWholeLines = {"AUTO", "FRAGMENT_LISTS", "PAINTER", "PAINTER_NEWELL"};

const Solver kSolvers[] = {
    {"LINE_REUSE", false, true, "it moves no power while it traces, which directions could follow",
     kAllProjectors, ""},
    {"MULTIPATH", true, false,
     "light goes on from one bundle to the next, so that their directions must be independent",
     kAllProjectors, ""},
    {"STOCHASTIC_ITERATION", true, true,
     "light goes on from one bundle to the next whole, so that their directions must be "
     "independent and of equal weight",
     kWholeLines,
     "exchanges found with a small probability have a weight without bound, with which the "
     "iteration does not converge"},
    {"RANDOM_WALK",
     true,
     true,
     "it walks along random local rays and has no bundles",
     {"AUTO"},
     "it walks along local rays and has no bundles to project"},
};

std::string join(const Names& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : " or ") + name;
    return text;
}

[[noreturn]] void refuse(const std::string& what, const std::string& why,
                         const std::string& remedy) {
    throw invalidArgument(what + ": " + why + "; choose " + remedy);
}

}  // namespace

void checkCombination(const Settings& settings, size_t lightSetCount) {
    const Solver& solver =
        *std::find_if(std::begin(kSolvers), std::end(kSolvers),
                      [&](const Solver& s) { return settings.solver == s.name; });
    Names directions, equallyWeighted;
    for (const DirectionMethod& method : directionMethods())
        if ((method.isIndependent || !solver.needsIndependence) &&
            (!method.isWeighted || !solver.needsEqualWeights)) {
            directions.push_back(method.name);
            if (!method.isWeighted) equallyWeighted.push_back(method.name);
        }
    if (settings.thesisLiteral && contains(directions, settings.directions) &&
        !contains(equallyWeighted, settings.directions))
        refuse("thesis_literal does not work with directions " + settings.directions,
               "the pseudo-code of the thesis knows no weights",
               "directions " + join(equallyWeighted));
    if (!contains(directions, settings.directions))
        refuse(
            "solver " + settings.solver + " does not work with directions " + settings.directions,
            solver.whyDirections, "directions " + join(directions));
    if (!contains(solver.projectors, settings.projector))
        refuse("solver " + settings.solver + " does not work with projector " + settings.projector,
               solver.whyProjectors, "projector " + join(solver.projectors));
    const bool isRoulette = settings.smallPatches == "ROULETTE";
    if (settings.solver == "RANDOM_WALK" && isRoulette)
        refuse("solver RANDOM_WALK does not work with small_patches ROULETTE",
               "local rays have no pixels", "small_patches CENTRE_SAMPLING");
    if (settings.linesPerBundle == 1 && (isRoulette || settings.projector != "AUTO"))
        refuse("lines_per_bundle 1 does not work with projector " + settings.projector +
                   " and small_patches " + settings.smallPatches,
               "single lines are traced and not projected",
               "projector AUTO and small_patches CENTRE_SAMPLING");
    if (settings.thesisLiteral && settings.solver != "MULTIPATH")
        refuse("thesis_literal does not work with solver " + settings.solver,
               "it is a variant of one method", "solver MULTIPATH");
    if (lightSetCount > 0 && settings.solver != "LINE_REUSE")
        refuse("solver " + settings.solver + " does not work with light sets",
               "it moves the light of all sets while it traces and cannot tell them apart",
               "solver LINE_REUSE");
}

}  // namespace raybundle
