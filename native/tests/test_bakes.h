// SPDX-License-Identifier: GPL-3.0-or-later
//
// Whole bakes of small rooms and ways to compare them.
#pragma once

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
// Whether a part of a report contains a text.
bool mentions(const Json& part, const std::string& text);
// Whether a report has a warning, and an entry of skipped work, of this identifier.
bool warns(const Json& report, WarningId id);
bool skips(const Json& report, SkippedWork work);
// How often such work was skipped, by the report.
uint64_t skippedCount(const Json& report, SkippedWork work);

std::vector<glm::vec3> cornerLight(const Bake& bake, int32_t instance, rb_output output);
// All outputs of all corners of the first three instances, which every room has.
std::vector<glm::vec3> everything(const Bake& bake);

// Largest difference over the largest value.
double difference(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b);
// Relative RMS difference.
double noise(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b);

// A room with two boxes and a lamp below the ceiling.
Scene litRoom(float reflectance = 0.6f);

// Coarse and quick, with a fixed number of bundles.
void setQuick(Bake& bake, int bundleCount = 64);
std::vector<glm::vec3> bakeQuick(const Scene& scene, int seed = 0, int threads = 0);

}  // namespace raybundle::test
