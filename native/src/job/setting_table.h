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
    {"patch_size",
     "Edge length of the patches on which the light is computed; 0 chooses it automatically",
     &Settings::patchSize, 0, 1e9, "m"},
    {"max_patches",
     "Maximum number of patches; patches become larger to stay below it, and small faces share "
     "patches",
     &Settings::maxPatches, 1, double(kMostPatches)},
    {"refine",
     "Use smaller patches at the edges of shadows and close to lamps, if the gain is worth the "
     "time",
     &Settings::refine},
    {"contacts",
     "Use smaller patches beside gaps much narrower than a patch, such as on a table below the "
     "rim of a plate",
     &Settings::contacts},
    {"adapt_meshes",
     "Give the meshes vertices where the light needs them and show the light there; the bake "
     "computes the light twice",
     &Settings::adaptMeshes},
    {"max_vertices",
     "Maximum number of vertices of all adapted meshes together; meshes that have more keep theirs",
     &Settings::maxVertices, 1, double(1 << 26)},
    {"discontinuity_lines",
     "Let edges of adapted meshes follow the edges of hard shadows, where this takes few vertices; "
     "the light then differs between the corners of a vertex, which one value per vertex cannot "
     "show",
     &Settings::discontinuityLines},
    {"count_adaptive",
     "Count the vertices that the topology Adaptive would need, without changing any mesh; takes "
     "some time more",
     &Settings::countAdaptive},
    {"draft",
     "Light at once instead of little noise: no rays from noisy surfaces, and no last solve after "
     "those that measure the noise",
     &Settings::draft},
    {"min_bundles", "Minimum number of bundles, even if the noise is already below the target",
     &Settings::minBundles, 2, 1 << 24},
    {"max_bundles", "Maximum number of bundles, even if the noise is still above the target",
     &Settings::maxBundles, 2, 1 << 24},
    {"lines_per_bundle",
     "Number of lines in each bundle; 0 chooses it automatically, at two lines per patch",
     &Settings::linesPerBundle, 0, 1 << 26},
    {"memory_limit",
     "Maximum memory of a bake, in MB, half of it for the exchanges between patches; 0 allows "
     "three "
     "quarters of the computer's memory",
     &Settings::memoryLimit, 0, 1e9, "MB"},
    {"seed", "Seed of the random numbers; the same seed gives the same noise", &Settings::seed, 0,
     INT32_MAX},
    {"threads", "Number of processor threads; 0 uses all", &Settings::threads, 0, 1024},

    // Methods.
    {"solver", "How surfaces exchange light", &Settings::solver},
    {"estimator", "Which events of a walk contribute light, for the solver Random Walk",
     &Settings::estimator, 0, 1, "", kOfRandomWalk},
    {"thesis_literal",
     "Follow the pseudo-code of the thesis with the solver Multipath, for comparison",
     &Settings::thesisLiteral, 0, 1, "", kOfThesis},
    {"first_shot", "How the light of lamps and the world is distributed before any bundle",
     &Settings::firstShot},
    {"local_rays",
     "Number of rays from the lights, for the first shots Shoot and Extended; 0 chooses it "
     "automatically",
     &Settings::localRays, 0, INT32_MAX, "", kOfShots},
    {"directions", "How the directions of the bundles are chosen", &Settings::directions},
    {"projector", "How the lines of a bundle find the surfaces that they meet",
     &Settings::projector},
    {"plane_count", "Number of planes per direction, for the projector Planes",
     &Settings::planeCount, 1, 64, "", kOfPlanes},
    {"plane_placement", "Where the projector Planes places its planes", &Settings::planePlacement,
     0, 1, "", kOfPlanes},
    {"plane_coherence",
     "Derive the depth buffers of the projector Planes from each other; 0 computes each one "
     "separately, to measure the time saved",
     &Settings::planeCoherence, 0, 1, "", kOfPlanes},
    {"small_patches", "How lines meet patches that are smaller than a pixel",
     &Settings::smallPatches},
    {"reconstruction", "How the light on patches becomes values at vertices",
     &Settings::reconstruction},
    {"regularization",
     "Weight of the penalty on changes of slope across edges, for the reconstruction Least "
     "Squares",
     &Settings::regularization, 0, 1e3},
    {"final_gather",
     "Gather the light of other surfaces at the vertices too, where it varies between them; for "
     "the reconstruction Point and for meshes that modifiers subdivide",
     &Settings::finalGather},

    // Skips (job/skips.h). A skip that is 0 makes the bake do the work although the scene does not
    // need it.
    {"skip.darkness", "Leave out the bundles and the solve if no light reaches any surface",
     &Settings::skipDarkness},
    {"skip.reflection",
     "Leave out the bundles and the solve if no surface reflects light and lines carry no other "
     "light",
     &Settings::skipReflection},
    {"skip.geometry", "Keep patches and lines if the geometry is unchanged since the last bake",
     &Settings::skipGeometry},
    {"skip.lights", "Keep the first shot if geometry and lights are unchanged since the last bake",
     &Settings::skipLights},
    {"skip.facing", "Leave out shadow rays to a light that the surface cannot face",
     &Settings::skipFacing},
    {"skip.occluders", "Leave out the reconstruction of objects that are not baked",
     &Settings::skipOccluders},
    {"skip.lit",
     "Leave out the noise of a light that is fully visible, because its light is known exactly",
     &Settings::skipLit},
    {"skip.weak", "Leave out most shadow rays to a light that contributes little",
     &Settings::skipWeak},
    {"skip.inside", "Leave out most shadow rays from the inside of solids", &Settings::skipInside},
    {"skip.gather", "Leave out the final gather where interpolation is accurate enough",
     &Settings::skipGather},
    {"skip.bundles", "Leave out further bundles when the noise has reached its target",
     &Settings::skipBundles},
    {"skip.warm_start",
     "Start the solve from the solution of the last bake, which takes fewer iterations",
     &Settings::skipWarmStart},
    {"skip.sheets", "Project neighbouring faces of equal shape in one plane together",
     &Settings::skipSheets},
    {"skip.lamp_insides", "Leave out the emission inside closed surfaces that contain nothing else",
     &Settings::skipLampInsides},
    {"skip.clusters",
     "Exchange light between clusters of patches where patches are not shown and finer than "
     "needed",
     &Settings::skipClusters},
};

}  // namespace raybundle
