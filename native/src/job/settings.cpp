// SPDX-License-Identifier: GPL-3.0-or-later
#include "job/settings.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "job/error.h"

namespace raybundle {
namespace {

template <class T>
struct Number {
    const char* name;
    T Settings::*member;
    T least, most;
};

const std::vector<Number<int>>& integers() {
    static const std::vector<Number<int>> table = {
        {"max_patches", &Settings::maxPatches, 1, int(kMostPatches)},
        {"min_bundles", &Settings::minBundles, 2, 1 << 24},
        {"max_bundles", &Settings::maxBundles, 2, 1 << 24},
        {"refine", &Settings::refine, 0, 1},
        {"contacts", &Settings::contacts, 0, 1},
        {"lines_per_bundle", &Settings::linesPerBundle, 0, 1 << 26},
        {"seed", &Settings::seed, 0, INT32_MAX},
        {"threads", &Settings::threads, 0, 1024},
        {"plane_count", &Settings::planeCount, 1, 64},
        {"thesis_literal", &Settings::thesisLiteral, 0, 1},
        {"local_rays", &Settings::localRays, 0, INT32_MAX},
        {"plane_coherence", &Settings::planeCoherence, 0, 1},
        {"final_gather", &Settings::finalGather, 0, 1},
        {"skip.darkness", &Settings::skipDarkness, 0, 1},
        {"skip.reflection", &Settings::skipReflection, 0, 1},
        {"skip.geometry", &Settings::skipGeometry, 0, 1},
        {"skip.lights", &Settings::skipLights, 0, 1},
        {"skip.facing", &Settings::skipFacing, 0, 1},
        {"skip.sheets", &Settings::skipSheets, 0, 1},
        {"skip.occluders", &Settings::skipOccluders, 0, 1},
        {"skip.lit", &Settings::skipLit, 0, 1},
        {"skip.weak", &Settings::skipWeak, 0, 1},
        {"skip.inside", &Settings::skipInside, 0, 1},
        {"skip.lamp_insides", &Settings::skipLampInsides, 0, 1},
        {"skip.clusters", &Settings::skipClusters, 0, 1},
        {"skip.gather", &Settings::skipGather, 0, 1},
        {"skip.bundles", &Settings::skipBundles, 0, 1},
        {"skip.warm_start", &Settings::skipWarmStart, 0, 1},
    };
    return table;
}

const std::vector<Number<float>>& floats() {
    static const std::vector<Number<float>> table = {
        {"target_error", &Settings::targetError, 1e-5f, 10.0f},
        {"patch_size", &Settings::patchSize, 0.0f, 1e9f},
        {"memory_limit", &Settings::memoryLimit, 1.0f, 1e9f},
        {"regularization", &Settings::regularization, 0.0f, 1e3f},
    };
    return table;
}

struct Choice {
    const char* name;
    std::string Settings::*member;
    std::vector<const char*> values;
};

std::vector<const char*> directionNames() {
    std::vector<const char*> names;
    for (const DirectionMethod& method : directionMethods()) names.push_back(method.name);
    return names;
}

const std::vector<Choice>& choices() {
    static const std::vector<Choice> table = {
        {"solver",
         &Settings::solver,
         {"LINE_REUSE", "MULTIPATH", "STOCHASTIC_ITERATION", "RANDOM_WALK"}},
        {"first_shot", &Settings::firstShot, {"GATHER", "SHOOT", "EXTENDED"}},
        {"directions", &Settings::directions, directionNames()},
        {"projector",
         &Settings::projector,
         {"AUTO", "FRAGMENT_LISTS", "PAINTER", "PAINTER_NEWELL", "PLANE", "PLANES"}},
        {"small_patches", &Settings::smallPatches, {"CENTRE_SAMPLING", "ROULETTE"}},
        {"reconstruction", &Settings::reconstruction, {"LEAST_SQUARES", "AREA_AVERAGE", "POINT"}},
        {"plane_placement",
         &Settings::planePlacement,
         {"SYSTEMATIC", "STRATIFIED", "CLOSE_DISTANCE"}},
        {"estimator", &Settings::estimator, {"COLLISION", "SURVIVAL", "ABSORPTION"}},
    };
    return table;
}

template <class Table>
const auto& find(const Table& table, const std::string& name) {
    const auto found =
        std::find_if(table.begin(), table.end(), [&](const auto& row) { return name == row.name; });
    if (found == table.end())
        throw invalidArgument("there is no setting \"" + name + "\" of this type");
    return *found;
}

template <class T>
void setNumber(Settings& settings, const std::vector<Number<T>>& table, const std::string& name,
               T value) {
    const Number<T>& number = find(table, name);
    if (!(value >= number.least && value <= number.most))
        throw invalidArgument("setting \"" + name + "\" must lie between " +
                              std::to_string(number.least) + " and " + std::to_string(number.most));
    settings.*number.member = value;
}

}  // namespace

const std::vector<DirectionMethod>& directionMethods() {
    static const std::vector<DirectionMethod> table = {
        // name, independent, weighted
        {"LOW_DISCREPANCY", false, false},
        {"RANDOM", true, false},
        {"ADAPTIVE", true, true},
    };
    return table;
}

PlanePlacement Settings::planePlacementKind() const {
    if (planePlacement == "STRATIFIED") return PlanePlacement::STRATIFIED;
    if (planePlacement == "CLOSE_DISTANCE") return PlanePlacement::CLOSE_DISTANCE;
    return PlanePlacement::SYSTEMATIC;
}

void Settings::set(const std::string& name, int value) {
    setNumber(*this, integers(), name, value);
}

void Settings::set(const std::string& name, float value) {
    setNumber(*this, floats(), name, value);
}

void Settings::set(const std::string& name, const std::string& value) {
    const Choice& choice = find(choices(), name);
    std::string known;
    for (const char* candidate : choice.values) {
        if (value == candidate) {
            this->*choice.member = value;
            return;
        }
        known += known.empty() ? candidate : std::string(", ") + candidate;
    }
    throw invalidArgument("setting \"" + name + "\" must be one of " + known + ", not \"" + value +
                          "\"");
}

void Settings::get(const std::string& name, int& value) const {
    value = this->*find(integers(), name).member;
}

void Settings::get(const std::string& name, float& value) const {
    value = this->*find(floats(), name).member;
}

const std::string& Settings::get(const std::string& name) const {
    return this->*find(choices(), name).member;
}

bool Settings::hasIndependentDirections() const {
    const auto& methods = directionMethods();
    return std::find_if(methods.begin(), methods.end(),
                        [&](const DirectionMethod& method) { return directions == method.name; })
        ->isIndependent;
}

}  // namespace raybundle
