// SPDX-License-Identifier: GPL-3.0-or-later
//
// The values that the choices among the settings of a bake can take. Each choice is an enum and a
// table with a row for each value: its name in the C interface, a line of help, and the abilities
// of the value. Other code uses the enum or the table; the names are only for callers, messages and
// reports.
//
// The rows are in the order of the enum, and the first value is the default. Blender files store a
// value as its index in the add-on's list, which has the same order: add new values at the end.
#pragma once

#include <cstddef>
#include <iterator>

namespace raybundle {

// --------------------------------------------------------------------------------------------
// Solver: how light is passed on between surfaces
// --------------------------------------------------------------------------------------------

enum class Solver { LINE_REUSE, MULTIPATH, STOCHASTIC_ITERATION, RANDOM_WALK };

// Abilities of a solver: the bits of SolverRow::abilities.
struct SolverCan {
    enum Ability : unsigned {
        // Sends light along bundles of lines. A solver without this ability follows local rays, and
        // uses no directions, projector or pixels.
        TRACE_BUNDLES = 1 << 0,
        // Accepts directions that depend on the previous ones, as in a low-discrepancy sequence.
        USE_DEPENDENT_DIRECTIONS = 1 << 1,
        // Accepts directions with weights other than 1.
        USE_WEIGHTED_DIRECTIONS = 1 << 2,
        // Accepts exchanges that are found only with some probability and then stand for several
        // lines.
        USE_CHANCE_EXCHANGES = 1 << 3,
        // Keeps the lines of all bundles as counts and solves on these. Lines may then be denser
        // where patches are small, patches may be cut or clustered according to their light, and
        // the next bake of an unchanged geometry needs no new lines.
        COUNT_LINES = 1 << 4,
        // Keeps the light of each light set separately.
        CARRY_LIGHT_SETS = 1 << 5,
        // Accounts for the angles at which light arrives and leaves, as needed for gloss and other
        // surfaces whose reflectance depends on the angle.
        CARRY_ANGLES = 1 << 6,
        // Carries on the light that passes through translucent surfaces.
        CARRY_TRANSLUCENCE = 1 << 7,
        // Computes the light of the world and of other surfaces on objects that take no part in the
        // exchange of light.
        LIGHT_WITHOUT_EXCHANGE = 1 << 8,
        // Has a variant that follows the pseudo-code of the thesis (setting thesis_literal).
        FOLLOW_THE_THESIS = 1 << 9,
    };
};

// A row of the table of solvers. All strings are static.
struct SolverRow {
    Solver value;
    const char* name;
    const char* help;
    const char* whyDirections;  // reason in the error message for directions it cannot use
    const char* whyProjectors;  // reason in the error message for projectors it cannot use
    unsigned abilities;         // bits of SolverCan
};

inline constexpr SolverRow kSolvers[] = {
    {Solver::LINE_REUSE, "LINE_REUSE",
     "Store all lines in a sparse matrix and solve the system of this matrix to convergence",
     "it moves no light while it traces, so that directions cannot adapt to the light", "",
     SolverCan::TRACE_BUNDLES | SolverCan::USE_DEPENDENT_DIRECTIONS |
         SolverCan::USE_CHANCE_EXCHANGES | SolverCan::COUNT_LINES | SolverCan::CARRY_LIGHT_SETS |
         SolverCan::CARRY_ANGLES | SolverCan::CARRY_TRANSLUCENCE |
         SolverCan::LIGHT_WITHOUT_EXCHANGE},
    {Solver::MULTIPATH, "MULTIPATH",
     "Each bundle passes on a part of the light that is not distributed yet. Two chains, each of "
     "half of the bundles, measure the noise",
     "it passes light from one bundle to the next, so that directions must be independent", "",
     SolverCan::TRACE_BUNDLES | SolverCan::USE_WEIGHTED_DIRECTIONS |
         SolverCan::USE_CHANCE_EXCHANGES | SolverCan::FOLLOW_THE_THESIS},
    {Solver::STOCHASTIC_ITERATION, "STOCHASTIC_ITERATION",
     "Each bundle passes on all the light that the previous bundle brought; the result is the "
     "mean. Two chains, each of half of the bundles, measure the noise",
     "it passes all light from one bundle to the next, so that directions must be independent "
     "and of equal weight",
     "it does not converge with exchanges that are found with a small probability, because their "
     "weights have no bound",
     SolverCan::TRACE_BUNDLES},
    {Solver::RANDOM_WALK, "RANDOM_WALK",
     "Light follows random local rays from surface to surface; there are no bundles",
     "it follows random local rays and has no bundles",
     "it follows local rays and has no bundles to project", 0},
};

// --------------------------------------------------------------------------------------------
// First shot: how the light of the sources is distributed before any bundle
// --------------------------------------------------------------------------------------------

enum class FirstShotKind { GATHER, SHOOT, EXTENDED };

// A row of the table of first shots. All strings are static.
struct FirstShotRow {
    FirstShotKind value;
    const char* name;
    const char* help;
    // Whether each side gathers its light by rays of its own. Its angles of arrival and the light
    // of each source are then known. Otherwise rays from the sources bring the light.
    bool isGathered;
};

inline constexpr FirstShotRow kFirstShots[] = {
    // value, name, help, gathered
    {FirstShotKind::GATHER, "GATHER", "Trace shadow rays from the receivers to the lights", true},
    {FirstShotKind::SHOOT, "SHOOT",
     "Trace rays from the lights to the first surfaces that they meet", false},
    {FirstShotKind::EXTENDED, "EXTENDED",
     "Shoot, then continue from surfaces brighter than the mean until light is everywhere", false},
};

// --------------------------------------------------------------------------------------------
// Directions: how the directions of the bundles are chosen (bundles/directions.h)
// --------------------------------------------------------------------------------------------

enum class DirectionKind { LOW_DISCREPANCY, RANDOM, ADAPTIVE };

// A row of the table of direction sequences. All strings are static.
struct DirectionRow {
    DirectionKind value;
    const char* name;
    const char* help;
    bool isIndependent;  // each direction is independent of the previous ones
    bool isWeighted;     // directions have weights other than 1
};

inline constexpr DirectionRow kDirectionKinds[] = {
    // value, name, help, independent, weighted
    {DirectionKind::LOW_DISCREPANCY, "LOW_DISCREPANCY",
     "Evenly spread directions, which give the least noise", false, false},
    {DirectionKind::RANDOM, "RANDOM", "Independent uniform directions", true, false},
    {DirectionKind::ADAPTIVE, "ADAPTIVE", "Independent directions, denser where more light passes",
     true, true},
};

// --------------------------------------------------------------------------------------------
// Projector: how the lines of a bundle find the surfaces that they meet (bundles/projector.h)
// --------------------------------------------------------------------------------------------

enum class ProjectorKind { AUTO, FRAGMENT_LISTS, PAINTER, PAINTER_NEWELL, PLANE, PLANES };

// A row of the table of projectors. All strings are static.
struct ProjectorRow {
    ProjectorKind value;
    const char* name;
    const char* help;
    bool isAutomatic;  // leaves the choice to the bake, which may use no projector
    bool isExact;      // finds all surfaces along a line, in order
    bool isByChance;   // finds an exchange with some probability and gives it a larger weight
};

inline constexpr ProjectorRow kProjectorKinds[] = {
    // value, name, help, automatic, exact, by chance
    {ProjectorKind::AUTO, "AUTO", "The fastest exact projector", true, true, false},
    {ProjectorKind::FRAGMENT_LISTS, "FRAGMENT_LISTS",
     "Exact lists of fragments per pixel, sorted by depth", false, true, false},
    {ProjectorKind::PAINTER, "PAINTER",
     "Patches are drawn in the order of their centres, which is wrong where they overlap in depth",
     false, false, false},
    {ProjectorKind::PAINTER_NEWELL, "PAINTER_NEWELL",
     "Patches are drawn in an order that Newell's tests have verified; cycles are broken and "
     "counted",
     false, false, false},
    {ProjectorKind::PLANE, "PLANE",
     "Two depth buffers per direction, one on each side of a random plane", false, false, true},
    {ProjectorKind::PLANES, "PLANES", "Two depth buffers for each of several planes per direction",
     false, false, true},
};

// --------------------------------------------------------------------------------------------
// Small patches: how patches smaller than a pixel are met
// --------------------------------------------------------------------------------------------

enum class SmallPatches { CENTRE_SAMPLING, ROULETTE };

// A row of the table of rules for small patches. All strings are static.
struct SmallPatchesRow {
    SmallPatches value;
    const char* name;
    const char* help;
    bool needsPixels;  // works with pixels only, not with single lines or local rays
};

inline constexpr SmallPatchesRow kSmallPatches[] = {
    // value, name, help, needs pixels
    {SmallPatches::CENTRE_SAMPLING, "CENTRE_SAMPLING",
     "A line meets the patches that cover the centre of its pixel: unbiased for patches of any "
     "size",
     false},
    {SmallPatches::ROULETTE, "ROULETTE",
     "A patch fills whole pixels; a patch smaller than a pixel is drawn with a probability "
     "proportional to its area",
     true},
};

// --------------------------------------------------------------------------------------------
// Choices whose values have only a name and a help text
// --------------------------------------------------------------------------------------------

// A row of the table of a choice without abilities. All strings are static.
template <class Choice>
struct NameRow {
    Choice value;
    const char* name;
    const char* help;
};

// How the light on patches becomes light at vertices (reconstruction/reconstruction.h).
enum class Reconstruction { LEAST_SQUARES, AREA_AVERAGE, POINT };

inline constexpr NameRow<Reconstruction> kReconstructions[] = {
    {Reconstruction::LEAST_SQUARES, "LEAST_SQUARES",
     "Vertex values whose interpolation over the faces is closest to the light on the surface"},
    {Reconstruction::AREA_AVERAGE, "AREA_AVERAGE",
     "The mean of the light on the faces around each vertex: never too bright or too dark, but "
     "blurred"},
    {Reconstruction::POINT, "POINT", "The light at the vertices themselves, as Cycles bakes it"},
};

// Where the projector PLANES places its planes (bundles/planes.h).
enum class PlanePlacement { SYSTEMATIC, STRATIFIED, CLOSE_DISTANCE };

inline constexpr NameRow<PlanePlacement> kPlanePlacements[] = {
    {PlanePlacement::SYSTEMATIC, "SYSTEMATIC", "At equal distances, with one common random shift"},
    {PlanePlacement::STRATIFIED, "STRATIFIED",
     "At a random position in each of several equal intervals"},
    {PlanePlacement::CLOSE_DISTANCE, "CLOSE_DISTANCE",
     "Some planes near surfaces, to separate surfaces that lie close together"},
};

// Which events of a walk of the solver RANDOM_WALK contribute light (transport/random_walk.cpp).
enum class Estimator { COLLISION, SURVIVAL, ABSORPTION };

inline constexpr NameRow<Estimator> kEstimators[] = {
    {Estimator::COLLISION, "COLLISION",
     "A walk contributes light at every surface that it meets, which gives the least noise"},
    {Estimator::SURVIVAL, "SURVIVAL", "A walk contributes light where it continues"},
    {Estimator::ABSORPTION, "ABSORPTION", "A walk contributes light where it ends"},
};

// --------------------------------------------------------------------------------------------
// Lookup of values
// --------------------------------------------------------------------------------------------

// Returns the table of a choice. The argument only selects the overload; its value is ignored.
constexpr const auto& rowsOf(Solver) { return kSolvers; }
constexpr const auto& rowsOf(FirstShotKind) { return kFirstShots; }
constexpr const auto& rowsOf(DirectionKind) { return kDirectionKinds; }
constexpr const auto& rowsOf(ProjectorKind) { return kProjectorKinds; }
constexpr const auto& rowsOf(SmallPatches) { return kSmallPatches; }
constexpr const auto& rowsOf(Reconstruction) { return kReconstructions; }
constexpr const auto& rowsOf(PlanePlacement) { return kPlanePlacements; }
constexpr const auto& rowsOf(Estimator) { return kEstimators; }

// Returns the row of a value in the table of its choice.
template <class Choice>
constexpr const auto& rowOf(Choice value) {
    return rowsOf(value)[size_t(value)];
}

// Returns the name of a value in the C interface. The string is static.
template <class Choice>
constexpr const char* choiceName(Choice value) {
    return rowOf(value).name;
}

// Returns whether the solver has the ability.
constexpr bool can(Solver solver, SolverCan::Ability ability) {
    return (rowOf(solver).abilities & ability) != 0;
}

// Returns whether a table has exactly one row for each value of a choice, in the order of the enum.
// Used in static assertions, also for tables in other files.
template <class Row, size_t count>
constexpr bool hasEveryValue(const Row (&rows)[count]) {
    for (size_t k = 0; k < count; ++k)
        if (size_t(rows[k].value) != k) return false;
    return count == std::size(rowsOf(rows[0].value));
}

static_assert(hasEveryValue(kSolvers) && hasEveryValue(kFirstShots) &&
              hasEveryValue(kDirectionKinds) && hasEveryValue(kProjectorKinds) &&
              hasEveryValue(kSmallPatches) && hasEveryValue(kReconstructions) &&
              hasEveryValue(kPlanePlacements) && hasEveryValue(kEstimators));

}  // namespace raybundle
