// SPDX-License-Identifier: GPL-3.0-or-later
#include "job/combination.h"

#include <string>

#include "job/error.h"

namespace raybundle {
namespace {

// Returns whether the solver works with the directions.
bool accepts(const SolverRow& solver, const DirectionRow& directions) {
    return (directions.isIndependent || can(solver.value, SolverCan::USE_DEPENDENT_DIRECTIONS)) &&
           (!directions.isWeighted || can(solver.value, SolverCan::USE_WEIGHTED_DIRECTIONS));
}

// Returns whether the solver works with the projector.
bool accepts(const SolverRow& solver, const ProjectorRow& projector) {
    if (!can(solver.value, SolverCan::TRACE_BUNDLES)) return projector.isAutomatic;
    return !projector.isByChance || can(solver.value, SolverCan::USE_CHANCE_EXCHANGES);
}

// Returns the advice for an error message: the setting and the names of the rows for which `willDo`
// returns true.
template <class Row, size_t count, class WillDo>
std::string remedy(const char* setting, const Row (&rows)[count], const WillDo& willDo) {
    std::string text;
    for (const Row& row : rows)
        if (willDo(row)) text += (text.empty() ? "" : " or ") + std::string(row.name);
    return std::string(setting) + " " + text;
}

// Returns the advice to choose a solver with an ability.
std::string solversThatCan(SolverCan::Ability ability) {
    return remedy("solver", kSolvers,
                  [&](const SolverRow& row) { return can(row.value, ability); });
}

// Returns the advice to choose a rule for small patches that works without pixels.
std::string smallPatchesWithoutPixels() {
    return remedy("small_patches", kSmallPatches,
                  [](const SmallPatchesRow& row) { return !row.needsPixels; });
}

// Throws Error(INVALID_ARGUMENT) with a message of what does not work, why, and what to choose
// instead.
[[noreturn]] void refuse(const std::string& what, const std::string& why,
                         const std::string& instead) {
    throw invalidArgument(what + ": " + why + "; choose " + instead);
}

void checkDirections(const Settings& settings) {
    const SolverRow& solver = rowOf(settings.solver);
    const DirectionRow& directions = rowOf(settings.directions);
    if (!accepts(solver, directions))
        refuse(std::string("solver ") + solver.name + " does not work with directions " +
                   directions.name,
               solver.whyDirections, remedy("directions", kDirectionKinds, [&](const auto& row) {
                   return accepts(solver, row);
               }));
    if (settings.thesisLiteral && directions.isWeighted)
        refuse(std::string("thesis_literal does not work with directions ") + directions.name,
               "the pseudo-code of the thesis has no weights",
               remedy("directions", kDirectionKinds,
                      [&](const auto& row) { return accepts(solver, row) && !row.isWeighted; }));
}

void checkProjector(const Settings& settings) {
    const SolverRow& solver = rowOf(settings.solver);
    const ProjectorRow& projector = rowOf(settings.projector);
    const SmallPatchesRow& smallPatches = rowOf(settings.smallPatches);
    if (!accepts(solver, projector))
        refuse(std::string("solver ") + solver.name + " does not work with projector " +
                   projector.name,
               solver.whyProjectors, remedy("projector", kProjectorKinds, [&](const auto& row) {
                   return accepts(solver, row);
               }));
    if (!can(settings.solver, SolverCan::TRACE_BUNDLES) && smallPatches.needsPixels)
        refuse(std::string("solver ") + solver.name + " does not work with small_patches " +
                   smallPatches.name,
               "local rays have no pixels", smallPatchesWithoutPixels());
    if (settings.linesPerBundle == 1 && (smallPatches.needsPixels || !projector.isAutomatic))
        refuse(std::string("lines_per_bundle 1 does not work with projector ") + projector.name +
                   " and small_patches " + smallPatches.name,
               "single lines are traced without a projector",
               remedy("projector", kProjectorKinds,
                      [](const ProjectorRow& row) { return row.isAutomatic; }) +
                   " and " + smallPatchesWithoutPixels());
}

}  // namespace

void checkCombination(const Settings& settings, size_t lightSetCount) {
    const std::string solver = choiceName(settings.solver);
    checkDirections(settings);
    checkProjector(settings);
    if (settings.thesisLiteral && !can(settings.solver, SolverCan::FOLLOW_THE_THESIS))
        refuse("thesis_literal does not work with solver " + solver,
               "it is a variant of another solver", solversThatCan(SolverCan::FOLLOW_THE_THESIS));
    if (lightSetCount > 0 && !can(settings.solver, SolverCan::CARRY_LIGHT_SETS))
        refuse("solver " + solver + " does not work with light sets",
               "it moves the light of all sets together and cannot separate them",
               solversThatCan(SolverCan::CARRY_LIGHT_SETS));
}

}  // namespace raybundle
