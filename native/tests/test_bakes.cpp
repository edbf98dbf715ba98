// SPDX-License-Identifier: GPL-3.0-or-later
#include "test_bakes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "test_scenes.h"

namespace raybundle::test {

Json reportOf(const Bake& bake) { return Json::parse(bake.reportJson()); }

bool mentions(const Json& part, const std::string& text) {
    return part.dump().find(text) != std::string::npos;
}

bool warns(const Json& report, WarningId id) {
    const Json& ids = report["warning_ids"];
    return std::find(ids.begin(), ids.end(), nameOf(id)) != ids.end();
}

bool skips(const Json& report, SkippedWork work) { return skippedCount(report, work) > 0; }

uint64_t skippedCount(const Json& report, SkippedWork work) {
    uint64_t count = 0;
    for (const Json& entry : report["skipped"])
        if (entry["id"] == textOf(work).id) count += entry["count"].get<uint64_t>();
    return count;
}

std::vector<glm::vec3> cornerLight(const Bake& bake, int32_t instance, rb_output output) {
    return bake.instanceLight(instance).perCorner(output);
}

std::vector<glm::vec3> everything(const Bake& bake) {
    std::vector<glm::vec3> all;
    for (int32_t i = 0; i < 3; ++i)
        for (rb_output output :
             {RB_OUTPUT_COMBINED, RB_OUTPUT_LIGHTING, RB_OUTPUT_DIRECT, RB_OUTPUT_INDIRECT})
            for (const glm::vec3& v : cornerLight(bake, i, output)) all.push_back(v);
    return all;
}

double indirectPower(const Bake& bake) {
    double power = 0;
    for (size_t i = 0; i < bake.patches().sideCount(); i += 2)
        power += double(bake.patches().area[i / 2]) * double(bake.patchIrradiance().indirect[i].y);
    return power;
}

double difference(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    if (a.size() != b.size()) return INFINITY;
    double most = 0, value = 0;
    for (size_t i = 0; i < std::min(a.size(), b.size()); ++i)
        for (int c = 0; c < 3; ++c) {
            most = std::max(most, std::abs(double(a[i][c]) - double(b[i][c])));
            value = std::max(value, std::abs(double(a[i][c])));
        }
    return most / value;  // NaN if all values are 0, which no test accepts
}

double noise(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    double squares = 0, signal = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        squares += double(glm::dot(a[i] - b[i], a[i] - b[i]));
        signal += double(glm::dot(a[i], a[i]));
    }
    return std::sqrt(squares / signal);
}

Scene litRoom(float reflectance) {
    Scene scene = roomWithBoxes(reflectance);
    scene.addLight(areaLight({2, 1.6, 2.6}, {0.3, 0, 0}, {0, -0.3, 0}, {5, 4, 3}));
    return scene;
}

void expectSameForThreads(const std::function<void(Bake&)>& set) {
    std::array<std::vector<glm::vec3>, 2> light;
    for (int threads : {1, 2}) {
        Bake bake;
        set(bake);
        bake.settings.threads = threads;
        bake.run(litRoom());
        light[size_t(threads - 1)] = everything(bake);
    }
    EXPECT_LT(difference(light[0], light[1]), 1e-5);
}

void setQuick(Bake& bake, int bundleCount) {
    bake.settings.patchSize = 0.25f;
    bake.settings.minBundles = bake.settings.maxBundles = bundleCount;
}

std::vector<glm::vec3> bakeQuick(const Scene& scene, int seed, int threads) {
    Bake bake;
    setQuick(bake);
    bake.settings.seed = seed;
    bake.settings.threads = threads;
    bake.run(scene);
    return everything(bake);
}

}  // namespace raybundle::test
