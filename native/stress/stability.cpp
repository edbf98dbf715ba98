// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bakes numerically difficult scenes and compares each with its exact answer, or with the same room
// at another size or place. Prints the table of docs/stability.md. The exit code is 1 if a case
// fails.
//
//   stability [--quick] [--only TEXT]
//
// --quick leaves out the long cases. --only selects the cases with TEXT in their names.
//
// The columns of the table:
//   deviation   largest relative deviation of the irradiance of the patches from an exact answer,
//               or relative RMS difference of the light at the corners from that of the other scene
//   surface     relative RMS deviation, by area, of the result interpolated over the faces
//   stated      error that the report states
//   balance     share of the emitted energy that is neither absorbed nor escapes
//   threads     whether bakes with one thread and with two give the same light to the last bit
//   counts      whether both sides of a pair have the same number of lines between them, and all
//               lines of a side end somewhere
//   noise       relative RMS difference between 64, 256 and 1024 bundles and 4096 with another
//               seed, which must fall
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>

#include "bake/bake.h"
#include "cases.h"
#include "job/error.h"
#include "test_scenes.h"

namespace raybundle::stress {
namespace {

using test::kPi;
// Counts are compared for all pairs of sides up to this number of patches.
constexpr size_t kMostPairs = 20000;
// Noise below this value need not fall any more.
constexpr double kNoNoise = 1e-4;
// The true error may be up to kStatedShare times the stated one (docs/validation.md), or kExact.
constexpr double kStatedShare = 1.25, kExact = 1e-3;

struct Light {
    std::vector<glm::vec3> corners;  // light at all corners of all instances, as irradiance, W/m^2
    nlohmann::json report;
};

Light lightOf(const Bake& bake, const Scene& scene) {
    Light light;
    light.report = nlohmann::json::parse(bake.reportJson());
    for (size_t i = 0; i < scene.instances.size(); ++i)
        for (const glm::vec3& v : bake.instanceLight(int32_t(i)).perCorner(RB_OUTPUT_LIGHTING))
            light.corners.push_back(float(kPi) * v);
    return light;
}

Light bakeOf(const Scene& scene, const Settings& settings) {
    Bake bake;
    bake.settings = settings;
    bake.run(scene);
    return lightOf(bake, scene);
}

double rms(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    if (a.size() != b.size()) return INFINITY;
    double difference = 0, signal = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        const glm::dvec3 x(a[i]), y(b[i]);
        difference += glm::dot(x - y, x - y);
        signal += glm::dot(y, y);
    }
    return std::sqrt(difference / signal);
}

// The results of one case, a row of the table. NAN if not measured.
struct Row {
    double deviation = NAN, surface = NAN, stated = NAN, balance = NAN;
    std::vector<double> noise;
    bool isFinite = true, isSameByThreads = true, isCounted = true;
    std::string said, failure;

    void check(bool holds, const std::string& what) {
        if (!holds) failure += (failure.empty() ? "" : ", ") + what;
    }
};

// Returns the largest relative deviation of the irradiance from `light` on the sides with a result.
// If more than half of a side is covered, only brighter light counts as a deviation.
double worstDeviation(const Bake& bake, const Scene& scene, double light) {
    const Patches& patches = bake.patches();
    double worst = 0;
    for (uint32_t i = 0; i < patches.sideCount(); ++i) {
        const Instance& instance = scene.instances[patches.parentAt(i).instance];
        if (i % 2 != uint32_t(instance.side)) continue;
        const glm::vec3 all = bake.patchIrradiance().all(i);
        for (int c = 0; c < 3; ++c) {
            const double off = double(all[c]) / light - 1;
            worst = std::max(worst, bake.exposedShare()[i] > 0.5f ? std::abs(off) : off);
        }
    }
    return worst;
}

// Returns the relative RMS deviation from `light`, by exposed area, of the light at the corners,
// interpolated to the centres of the patches with a result.
double surfaceDeviation(const Bake& bake, const Scene& scene, double light) {
    const Patches& patches = bake.patches();
    std::vector<std::vector<glm::vec3>> lit;
    for (size_t i = 0; i < scene.instances.size(); ++i)
        lit.push_back(bake.instanceLight(int32_t(i)).perCorner(RB_OUTPUT_LIGHTING));
    double sum = 0, all = 0;
    for (uint32_t i = 0; i < patches.sideCount(); ++i) {
        const Parent& parent = patches.parentAt(i);
        if (i % 2 != uint32_t(scene.instances[parent.instance].side)) continue;
        const Cell& cell = patches.cells[parent.cell];
        const std::array<float, 4> weights =
            cell.weights(patches.point(i / 2, glm::vec2(parent.isTriangle ? 1.0f / 3 : 0.5f)));
        double value = 0;
        for (size_t k = 0; k < 4; ++k)
            if (weights[k] != 0)
                value += kPi * double(weights[k] * lit[parent.instance][size_t(cell.corner[k])].x);
        const double area = double(patches.area[i / 2] * bake.exposedShare()[i]);
        sum += area * (value / light - 1) * (value / light - 1);
        all += area;
    }
    return all > 0 ? std::sqrt(sum / all) : 0;
}

bool areCountsRight(const Patches& patches) {
    if (patches.count() > kMostPairs) return true;
    const float pixel = float(std::sqrt(patches.totalArea / double(patches.count()) / 2));
    const LineCounts counts = test::traceLines(patches, pixel, 8);
    std::vector<std::vector<LineCount>> rows;
    for (uint32_t i = 0; i < counts.sideCount(); ++i) rows.push_back(counts.row(i));
    for (uint32_t i = 0; i < counts.sideCount(); ++i)
        for (int half = 0; half < 2; ++half) {
            uint64_t sum = counts.sky[i][size_t(half)];
            for (const LineCount& c : rows[i]) {
                // No line joins two points of one plane side. It would count twice.
                const auto& other = rows[c.side];
                const auto back = std::find_if(other.begin(), other.end(),
                                               [&](const LineCount& o) { return o.side == i; });
                if (back == other.end() || back->lines != c.lines) return false;
                sum += c.lines[size_t(half)];
            }
            if (sum != counts.total[i][size_t(half)]) return false;
        }
    return true;
}

Row measure(const Case& made) {
    Row row;
    Bake bake;
    bake.settings = made.settings;
    bake.settings.threads = 2;  // compared with one thread below
    try {
        bake.run(made.scene);
    } catch (const Error& error) {
        row.said = error.what();
        row.check(!made.says.empty() && row.said.find(made.says) != std::string::npos,
                  "ended in an error");
        return row;
    }
    const Light light = lightOf(bake, made.scene);
    for (const glm::vec3& v : light.corners)
        for (int c = 0; c < 3; ++c) row.isFinite = row.isFinite && std::isfinite(v[c]) && v[c] >= 0;
    row.check(row.isFinite, "not finite");

    if (made.light)
        row.deviation = worstDeviation(bake, made.scene, *made.light);
    else if (made.like)
        row.deviation = rms(light.corners, bakeOf(*made.like, made.likeSettings).corners);
    row.check(!(made.light || made.like) || row.deviation <= made.tolerance, "deviation");
    row.stated = light.report["error"]["total"];
    if (made.light) {
        row.surface = surfaceDeviation(bake, made.scene, *made.light);
        row.check(row.surface <= std::max(kExact, kStatedShare * row.stated), "stated error");
    }

    row.balance = light.report["energy"]["balance_error"];
    row.check(row.balance <= made.balance, "balance");
    for (const auto& warning : light.report["warnings"])
        row.said += (row.said.empty() ? "" : "; ") + warning.get<std::string>();
    row.check(made.says.empty() || row.said.find(made.says) != std::string::npos,
              "does not say \"" + made.says + "\"");

    Settings settings = made.settings;
    settings.threads = 1;
    const std::vector<glm::vec3> one = bakeOf(made.scene, settings).corners, &two = light.corners;
    row.isSameByThreads =
        one.size() == two.size() &&
        (one.empty() || std::memcmp(one.data(), two.data(), one.size() * sizeof(glm::vec3)) == 0);
    row.check(row.isSameByThreads, "threads");
    row.isCounted = areCountsRight(bake.patches());
    row.check(row.isCounted, "counts");

    if (made.hasNoise) {
        settings.threads = 0;
        auto by = [&](int bundles, int seed) {
            settings.minBundles = settings.maxBundles = bundles;
            settings.seed = seed;
            return bakeOf(made.scene, settings).corners;
        };
        const std::vector<glm::vec3> truth = by(4096, 9);
        for (int bundles : {64, 256, 1024}) row.noise.push_back(rms(by(bundles, 0), truth));
        for (size_t k = 1; k < row.noise.size(); ++k)
            row.check(row.noise[k] <= std::max(kNoNoise, row.noise[k - 1]), "noise");
    }
    return row;
}

void print(const Case& made, const Row& row) {
    auto number = [](double value) {
        return std::isnan(value) ? std::string("-") : printed("%.2g", value);
    };
    std::string expected =
        made.light  ? "irradiance " + number(*made.light) + " within " + number(made.tolerance)
        : made.like ? "the light of the original scene within " + number(made.tolerance)
                    : "balance";
    if (!made.says.empty()) expected += ", \"" + made.says + "\"";
    std::string noise;
    for (double value : row.noise) noise += (noise.empty() ? "" : ", ") + number(value);
    std::printf("| %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s |\n", made.group.c_str(),
                made.name.c_str(), expected.c_str(), number(row.deviation).c_str(),
                number(row.surface).c_str(), number(row.stated).c_str(),
                number(row.balance).c_str(), row.isSameByThreads ? "same" : "DIFFER",
                row.isCounted ? "right" : "WRONG", noise.c_str(),
                row.failure.empty() ? "pass" : ("FAIL: " + row.failure + " " + row.said).c_str());
    std::fflush(stdout);
}

int run(int count, char** arguments) {
    bool isQuick = false;
    std::string only;
    for (int k = 1; k < count; ++k) {
        if (!std::strcmp(arguments[k], "--quick")) isQuick = true;
        if (!std::strcmp(arguments[k], "--only") && k + 1 < count) only = arguments[++k];
    }
    std::printf(
        "| group | case | expected | deviation | surface | stated | balance | threads | counts | "
        "noise | |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
    int failures = 0;
    for (std::vector<Case> cases : {materialCases(), scaleCases(), geometryCases(isQuick)})
        for (const Case& made : cases) {
            if (made.name.find(only) == std::string::npos) continue;
            const Row row = measure(made);
            print(made, row);
            failures += !row.failure.empty();
        }
    return failures ? 1 : 0;
}

}  // namespace
}  // namespace raybundle::stress

int main(int count, char** arguments) { return raybundle::stress::run(count, arguments); }
