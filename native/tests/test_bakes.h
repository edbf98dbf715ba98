// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bakes of small rooms, and functions that compare bakes.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "scene/scene.h"

namespace raybundle::test {

using Json = nlohmann::json;

// Under sanitizers, which look for other faults than wrong light: no more of the same.
#ifdef RAYBUNDLE_FEW_BAKES
constexpr bool kFewBakes = true;
#else
constexpr bool kFewBakes = false;
#endif

Json reportOf(const Bake& bake);
// Returns whether a part of a report contains a text.
bool mentions(const Json& part, const std::string& text);
// Return whether a report has a warning, or an entry of skipped work, with this identifier.
bool warns(const Json& report, WarningId id);
bool skips(const Json& report, SkippedWork work);
// Returns how often this work was skipped, as the report states.
uint64_t skippedCount(const Json& report, SkippedWork work);

// Returns the output at each corner of an instance, W/(m^2 sr).
std::vector<glm::vec3> cornerLight(const Bake& bake, int32_t instance, rb_output output);
// Returns all outputs at all corners of the first three instances, which every room has.
std::vector<glm::vec3> everything(const Bake& bake);

// Returns the power of indirect light that the front sides of all patches get, second channel, W.
double indirectPower(const Bake& bake);

// Returns the largest absolute difference, relative to the largest absolute value.
double difference(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b);
// Returns the relative RMS difference.
double noise(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b);

// Returns a room with two boxes and a lamp below the ceiling.
Scene litRoom(float reflectance = 0.6f);

// Bakes litRoom(), with the settings that `set` makes, with one thread and with two, and expects the
// same light.
void expectSameForThreads(const std::function<void(Bake&)>& set);

// Sets coarse patches and a fixed number of bundles, for bakes that take little time.
void setQuick(Bake& bake, int bundleCount = 64);
std::vector<glm::vec3> bakeQuick(const Scene& scene, int seed = 0, int threads = 0);

}  // namespace raybundle::test
