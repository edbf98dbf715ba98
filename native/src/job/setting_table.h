// SPDX-License-Identifier: GPL-3.0-or-later
//
// The table of all settings of a bake: the name in the C interface, a line of help, the member of
// Settings, the range and the unit. Default values are those of Settings itself.
// rb_get_setting_info returns the rows to callers. Tests compare the add-on's properties and
// docs/c_api.md with the table.
#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>
#include <variant>

#include "job/settings.h"

namespace raybundle {

// The values of a choice with which another setting has an effect.
struct UsedWith {
    const char* choice = nullptr;  // name of the choice; null if the setting always has an effect
    uint32_t values = 0;           // bit k is set for value k of the choice
};

// Returns the values of a choice, by its table, for which `isUsed` returns true.
template <class Row, size_t count, class IsUsed>
constexpr UsedWith usedWith(const char* choice, const Row (&rows)[count], const IsUsed& isUsed) {
    UsedWith used{choice, 0};
    for (size_t k = 0; k < count; ++k)
        if (isUsed(rows[k])) used.values |= 1u << k;
    return used;
}

// Settings of one value of a choice alone.
inline constexpr UsedWith kOfThesis = usedWith("solver", kSolvers, [](const SolverRow& row) {
    return can(row.value, SolverCan::FOLLOW_THE_THESIS);
});
inline constexpr UsedWith kOfRandomWalk = usedWith(
    "solver", kSolvers, [](const SolverRow& row) { return row.value == Solver::RANDOM_WALK; });
inline constexpr UsedWith kOfShots =
    usedWith("first_shot", kFirstShots, [](const FirstShotRow& row) { return !row.isGathered; });
inline constexpr UsedWith kOfPlanes =
    usedWith("projector", kProjectorKinds,
             [](const ProjectorRow& row) { return row.value == ProjectorKind::PLANES; });

// A row of the table of settings. All strings are static.
struct Setting {
    const char* name;
    const char* help;
    std::variant<int Settings::*, float Settings::*, Solver Settings::*, FirstShotKind Settings::*,
                 DirectionKind Settings::*, ProjectorKind Settings::*, SmallPatches Settings::*,
                 Reconstruction Settings::*, PlanePlacement Settings::*, Estimator Settings::*>
        member;
    double least = 0, most = 1;  // inclusive range of a number; a switch is an int from 0 to 1
    const char* unit = "";       // "" for a number without a unit
    UsedWith usedWith{};
};

// The type of a member of Settings, from the type of the pointer to it.
template <class Member>
using ValueOf = std::decay_t<decltype(std::declval<Settings&>().*std::declval<Member>())>;

inline constexpr Setting kSettings[] = {
    // Quality.
    {"target_error", "Relative noise of the light at which the bake stops", &Settings::targetError,
     double(1e-5f), 10},
    {"patch_size", "Edge of the patches that the light is computed on; 0 is automatic",
     &Settings::patchSize, 0, 1e9, "m"},
    {"max_patches",
     "Most patches that subdivision may make; patches grow to stay below it, but a face is one at "
     "least",
     &Settings::maxPatches, 1, double(kMostPatches)},
    {"refine", "Smaller patches at the edges of shadows, where what that gains is worth the time",
     &Settings::refine},
    {"contacts",
     "Smaller patches beside gaps much narrower than a patch, as on a table below the rim of a "
     "plate",
     &Settings::contacts},
    {"min_bundles", "Fewest directions that are traced, even if there is less noise than wanted",
     &Settings::minBundles, 2, 1 << 24},
    {"max_bundles",
     "Most directions that are traced, even if there is still more noise than wanted",
     &Settings::maxBundles, 2, 1 << 24},
    {"lines_per_bundle", "Lines in each direction; 0 is automatic: two per patch",
     &Settings::linesPerBundle, 0, 1 << 26},
    {"memory_limit", "Most memory for the exchanges between patches, in MB", &Settings::memoryLimit,
     1, 1e9, "MB"},
    {"seed", "The same seed gives the same noise", &Settings::seed, 0, INT32_MAX},
    {"threads", "Processor threads to use; 0 is all", &Settings::threads, 0, 1024},

    // Methods.
    {"solver", "How light is passed on between surfaces", &Settings::solver},
    {"estimator", "What a walk of the solver Random Walk counts as light", &Settings::estimator, 0,
     1, "", kOfRandomWalk},
    {"thesis_literal",
     "The solver Multipath as the pseudo-code of the thesis has it, for comparison",
     &Settings::thesisLiteral, 0, 1, "", kOfThesis},
    {"first_shot", "How the light of lamps and world is distributed", &Settings::firstShot},
    {"local_rays",
     "Rays from the lights, of a first shot that shoots; 0 is as many as the noise asks for",
     &Settings::localRays, 0, INT32_MAX, "", kOfShots},
    {"directions", "How the directions of the bundles are chosen", &Settings::directions},
    {"projector", "How a bundle's lines find the surfaces they meet", &Settings::projector},
    {"plane_count", "Planes per direction, of the projector Planes", &Settings::planeCount, 1, 64,
     "", kOfPlanes},
    {"plane_placement", "Where the projector Planes puts its planes", &Settings::planePlacement, 0,
     1, "", kOfPlanes},
    {"plane_coherence",
     "The projector Planes makes the depth buffers of its planes from each other; 0 makes each "
     "anew, to measure what that saves",
     &Settings::planeCoherence, 0, 1, "", kOfPlanes},
    {"small_patches", "How patches smaller than a pixel are met", &Settings::smallPatches},
    {"reconstruction", "How patches become values at vertices", &Settings::reconstruction},
    {"regularization",
     "Weight of changes of the slope across edges in the reconstruction Least Squares",
     &Settings::regularization, 0, 1e3},
    {"final_gather",
     "Of the reconstruction Point, and of meshes that modifiers subdivide: gather the light of "
     "other surfaces at the vertices too, where it changes between them",
     &Settings::finalGather},

    // Skips (job/skips.h). A skip that is 0 makes the bake do the work although the scene does not
    // need it.
    {"skip.darkness", "Leave out bundles and solve if no light reaches any surface",
     &Settings::skipDarkness},
    {"skip.reflection",
     "Leave out bundles and solve if no surface reflects light and lines carry no other light",
     &Settings::skipReflection},
    {"skip.geometry", "Keep patches and lines if the geometry is as in the last bake",
     &Settings::skipGeometry},
    {"skip.lights", "Keep the first shot if geometry and lights are as in the last bake",
     &Settings::skipLights},
    {"skip.facing", "Leave out shadow rays to a light that the surface cannot face",
     &Settings::skipFacing},
    {"skip.occluders", "Leave out the reconstruction of objects that are not baked",
     &Settings::skipOccluders},
    {"skip.lit",
     "Leave out the noise of a light that is wholly visible: its light is known exactly",
     &Settings::skipLit},
    {"skip.weak", "Leave out most shadow rays to a light that gives little of all",
     &Settings::skipWeak},
    {"skip.inside", "Leave out most shadow rays from the inside of solids", &Settings::skipInside},
    {"skip.gather", "Leave out the final gather where interpolation follows the light",
     &Settings::skipGather},
    {"skip.bundles", "Leave out further bundles once the noise is at its target",
     &Settings::skipBundles},
    {"skip.warm_start",
     "Begin the solve with the solution of the last bake, which takes fewer iterations",
     &Settings::skipWarmStart},
    {"skip.sheets", "Project faces that lie in a plane with others of their kind as one",
     &Settings::skipSheets},
    {"skip.lamp_insides", "Leave out the emission inside of closed surfaces that hold nothing else",
     &Settings::skipLampInsides},
    {"skip.clusters",
     "Leave out the light of each patch where it is not shown and finer than needed",
     &Settings::skipClusters},
};

}  // namespace raybundle
