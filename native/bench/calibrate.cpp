// SPDX-License-Identifier: GPL-3.0-or-later
//
// Compares stated errors with true errors: bakes scenes with many seeds and targets and writes one
// line of JSON per bake. Usage: see kUsage.
//
// - True noise: the difference of the light per side of a tile from its mean over all seeds at the
//   least target, which has as many times the bundles as there are seeds. The result is corrected
//   for the share that the bake itself has in this mean.
// - True surface error: the difference of the light interpolated between the corners from the light
//   on patches with a third of the edge length, at each of these patches. The reference consists of
//   two bakes with independent bundles and shadow rays. The mean product of the two differences is
//   the square of the error without the noise of the reference. It is not computed if some objects
//   have much finer patches than others, because a third of the largest edge would be no reference
//   for these.
// - True noise of an object: the difference of the light at its corners from the mean over all
//   seeds at the same target, which has the same error apart from the noise.
// All errors are weighted by exposed area.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "command.h"
#include "job/error.h"
#include "patches/tiles.h"
#include "scene_file.h"

namespace raybundle::bench {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kUsage[] =
    R"(usage: calibrate SCENE.json ... [options]

  SCENE.json          of blend_tests/export_scene.py
  --seeds N           bakes with the seeds 1 .. N (20)
  --targets LIST      comma-separated values of target_error, the least last (0.05,0.02,0.01)
  --patch-size M      metres, 0 = automatic (0)
  --finer N           edges of the bake's patches over those of the reference (3)
  --reference-bundles N   of each half of the reference (400)
  --out FILE          lines are appended to it (standard output)
)";

// Seeds that no calibrated bake has.
constexpr int kReferenceSeeds[2] = {1 << 29, 1 << 30};
// The surface error is computed only if the largest patches' edge is at most this many times that
// of the finest ones.
constexpr float kMostSizes = 4;
// Objects whose RMS light is below this share of that of the brightest object count as black.
constexpr double kBlack = 1e-4;
// Relative standard error of the direct light in each half of the reference.
constexpr float kReferenceShotError = 0.01f;

struct Options {
    std::vector<std::string> scenes;
    int seeds = 20;
    std::vector<float> targets{0.05f, 0.02f, 0.01f};
    float patchSize = 0;
    int finer = 3, referenceBundles = 400;
    std::string out;
};

Options parseOptions(const std::vector<std::string>& arguments) {
    Options options;
    auto takeOption = [&](const std::string& name, const std::string& value) {
        if (name == "--seeds") {
            options.seeds = std::stoi(value);
        } else if (name == "--targets") {
            options.targets.clear();
            std::istringstream list(value);
            for (std::string item; std::getline(list, item, ',');)
                options.targets.push_back(std::stof(item));
        } else if (name == "--patch-size") {
            options.patchSize = std::stof(value);
        } else if (name == "--finer") {
            options.finer = std::stoi(value);
        } else if (name == "--reference-bundles") {
            options.referenceBundles = std::stoi(value);
        } else if (name == "--out") {
            options.out = value;
        } else {
            return false;
        }
        return true;
    };
    readArguments(
        arguments, [&](const std::string& scene) { options.scenes.push_back(scene); }, takeOption);
    if (options.scenes.empty()) throw invalidArgument("a scene is needed");
    return options;
}

// Returns the side of a patch that has a result, if there is one.
std::optional<uint32_t> bakedSide(const Scene& scene, const Patches& patches, uint32_t patch) {
    const Instance& instance = scene.instances[patches.parents[patches.parentOf[patch]].instance];
    if (instance.role != RB_ROLE_BAKE) return std::nullopt;
    return 2 * patch + uint32_t(instance.side);
}

glm::dvec3 lightAt(const Bake& bake, uint32_t side) {
    return glm::dvec3(bake.patchIrradiance().direct[side] + bake.patchIrradiance().indirect[side]);
}

// ------------------------------------------------------------------------------------------------
// Surface error
// ------------------------------------------------------------------------------------------------

// A point of a face and the true light around it.
struct Point {
    uint32_t instance = 0;
    std::array<int32_t, 4> corner{};
    std::array<float, 4> weights{};
    double area = 0;                  // exposed, m^2
    std::array<glm::dvec3, 2> light;  // irradiance of each half of the reference, W/m^2
};

std::vector<Point> reference(const Scene& scene, float patchSize, const Options& options) {
    std::vector<Point> points;
    for (size_t half = 0; half < 2; ++half) {
        Bake bake;
        bake.settings.patchSize = patchSize / float(options.finer);
        bake.settings.maxPatches = int32_t(kMostPatches);
        bake.settings.minBundles = bake.settings.maxBundles = options.referenceBundles;
        bake.settings.targetError = kReferenceShotError;
        bake.settings.seed = kReferenceSeeds[half];
        bake.run(scene);
        const Patches& patches = bake.patches();
        size_t next = 0;
        for (uint32_t patch = 0; patch < patches.count(); ++patch) {
            const auto side = bakedSide(scene, patches, patch);
            if (!side) continue;
            if (half == 0) {
                const Parent& parent = patches.parents[patches.parentOf[patch]];
                const Cell& cell = patches.cells[parent.cell];
                Point point;
                point.instance = parent.instance;
                point.corner = cell.corner;
                point.weights = cell.weights(patches.point(
                    patch, parent.isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f)));
                point.area = double(patches.area[patch] * bake.exposedShare()[*side]);
                points.push_back(point);
            }
            points[next++].light[half] = lightAt(bake, *side);
        }
    }
    return points;
}

double surfaceError(const std::vector<Point>& points, const Bake& bake) {
    double squares = 0, signal = 0;
    for (const Point& point : points) {
        const InstanceLight& light = bake.instanceLight(int32_t(point.instance));
        glm::dvec3 shown(0.0);
        for (size_t k = 0; k < 4; ++k)
            if (point.corner[k] >= 0)
                shown +=
                    double(point.weights[k]) * glm::dvec3(light.direct[size_t(point.corner[k])] +
                                                          light.indirect[size_t(point.corner[k])]);
        squares += point.area * glm::dot(shown - point.light[0], shown - point.light[1]);
        signal += point.area * glm::dot(point.light[0], point.light[1]);
    }
    return signal > 0 ? std::sqrt(std::max(squares, 0.0) / signal) : 0;
}

// ------------------------------------------------------------------------------------------------
// Noise
// ------------------------------------------------------------------------------------------------

struct SideLight {
    std::vector<glm::vec3> light;  // per tile with a result, W/m^2
    std::vector<float> area;       // exposed, m^2
};

SideLight sideLight(const Scene& scene, const Bake& bake) {
    const Patches& patches = bake.patches();
    std::vector<glm::vec3> light(patches.sideCount());
    std::vector<float> weight(patches.sideCount());
    for (uint32_t side = 0; side < patches.sideCount(); ++side) {
        light[side] = glm::vec3(lightAt(bake, side));
        weight[side] = patches.area[side / 2] * bake.exposedShare()[side];
    }
    const Tiles tiles(patches);
    const std::vector<glm::vec3> mean = tiles.mean(light, weight);
    const std::vector<float> area = tiles.sum(weight);
    SideLight result;
    for (uint32_t tile = 0; tile < tiles.sideCount() / 2; ++tile)
        if (const auto side = bakedSide(scene, tiles.patches(), tile)) {
            result.light.push_back(mean[*side]);
            result.area.push_back(area[*side]);
        }
    return result;
}

double noise(const SideLight& one, const std::vector<glm::dvec3>& mean) {
    double squares = 0, signal = 0;
    for (size_t i = 0; i < mean.size(); ++i) {
        const glm::dvec3 off = glm::dvec3(one.light[i]) - mean[i];
        squares += double(one.area[i]) * glm::dot(off, off);
        signal += double(one.area[i]) * glm::dot(mean[i], mean[i]);
    }
    return signal > 0 ? std::sqrt(squares / signal) : 0;
}

// The light that one object shows at its corners.
struct CornerLight {
    std::vector<glm::dvec3> light;  // W/m^2
    std::vector<double> area;       // exposed, m^2
};

// Returns the light of each baked instance, by index of the instance.
std::vector<CornerLight> cornerLights(const Scene& scene, const Bake& bake) {
    const Patches& patches = bake.patches();
    std::vector<CornerLight> result(scene.instances.size());
    for (size_t i = 0; i < result.size(); ++i) {
        if (scene.instances[i].role != RB_ROLE_BAKE) continue;
        const InstanceLight& shown = bake.instanceLight(int32_t(i));
        for (size_t c = 0; c < shown.direct.size(); ++c)
            result[i].light.push_back(glm::dvec3(shown.direct[c] + shown.indirect[c]));
        result[i].area.assign(shown.direct.size(), 0);
    }
    for (uint32_t patch = 0; patch < patches.count(); ++patch) {
        const auto side = bakedSide(scene, patches, patch);
        if (!side) continue;
        const Parent& parent = patches.parents[patches.parentOf[patch]];
        const Cell& cell = patches.cells[parent.cell];
        const double area = double(patches.area[patch] * bake.exposedShare()[*side]);
        for (const int32_t corner : cell.corner)
            if (corner >= 0)
                result[parent.instance].area[size_t(corner)] += area / cell.cornerCount();
    }
    return result;
}

// Adds the stated and the true noise of each object to the last rows, which are those of the bakes
// of one target. `seen` is indexed by bake and instance.
void compareObjects(const std::vector<std::vector<CornerLight>>& seen,
                    const std::vector<Json>& reports, std::vector<Json>& rows) {
    const double count = double(seen.size());
    auto meanSquare = [](const CornerLight& object) {
        double squares = 0, area = 0;
        for (size_t c = 0; c < object.light.size(); ++c) {
            squares += object.area[c] * glm::dot(object.light[c], object.light[c]);
            area += object.area[c];
        }
        return area > 0 ? squares / area : 0;
    };
    double brightest = 0;
    for (const CornerLight& object : seen.front())
        brightest = std::max(brightest, meanSquare(object));
    for (size_t i = 0; i < seen.front().size(); ++i) {
        if (!(meanSquare(seen.front()[i]) > kBlack * kBlack * brightest)) continue;
        std::vector<glm::dvec3> mean(seen.front()[i].light.size(), glm::dvec3(0.0));
        for (const auto& bake : seen)
            for (size_t c = 0; c < mean.size(); ++c) mean[c] += bake[i].light[c] / count;
        for (size_t k = 0; k < seen.size(); ++k) {
            const Json& entry = reports[k].at("objects").at(i);
            double squares = 0, signal = 0;
            for (size_t c = 0; c < mean.size(); ++c) {
                const glm::dvec3 off = seen[k][i].light[c] - mean[c];
                squares += seen[k][i].area[c] * glm::dot(off, off);
                signal += seen[k][i].area[c] * glm::dot(mean[c], mean[c]);
            }
            const double noise = std::sqrt(squares / signal / (1 - 1 / count));
            rows[rows.size() - seen.size() + k]["objects"].push_back(
                {{"name", entry.at("name")},
                 {"stated", entry.at("error").at("noise")},
                 {"true", noise}});
        }
    }
}

// ------------------------------------------------------------------------------------------------

void calibrate(const std::string& path, const Options& options, std::ostream& out) {
    const Scene scene = readScene(path);
    const std::string name = std::filesystem::path(path).stem().string();
    std::vector<Json> rows;
    std::vector<SideLight> lights;
    std::vector<Point> points;
    for (float target : options.targets) {
        std::vector<std::vector<CornerLight>> seen;
        std::vector<Json> reports;
        for (int seed = 1; seed <= options.seeds; ++seed) {
            Bake bake;
            bake.settings.patchSize = options.patchSize;
            bake.settings.targetError = target;
            bake.settings.seed = seed;
            bake.run(scene);
            const bool isUniform = kMostSizes * bake.patches().finest >= bake.patches().size;
            if (points.empty() && isUniform)
                points = reference(scene, bake.patches().size, options);
            const Json report = Json::parse(bake.reportJson());
            Json stated = report.at("error");
            stated["patches"] = report.at("estimated_error");
            rows.push_back({{"scene", name},
                            {"target", target},
                            {"seed", seed},
                            {"patches", report.at("patches")},
                            {"bundles", report.at("bundles")},
                            {"seconds", report.at("seconds")},
                            {"stated", stated},
                            {"warnings", report.at("warnings").size()},
                            {"true", Json::object()}});
            if (isUniform) rows.back()["true"]["surface"] = surfaceError(points, bake);
            lights.push_back(sideLight(scene, bake));
            seen.push_back(cornerLights(scene, bake));
            reports.push_back(report);
        }
        if (options.seeds > 1) compareObjects(seen, reports, rows);
    }
    std::vector<glm::dvec3> mean(lights.back().light.size(), glm::dvec3(0.0));
    const size_t firstOfLeast = lights.size() - size_t(options.seeds);
    for (size_t k = firstOfLeast; k < lights.size(); ++k)
        for (size_t i = 0; i < mean.size(); ++i)
            mean[i] += glm::dvec3(lights[k].light[i]) / double(options.seeds);
    for (size_t k = 0; k < rows.size(); ++k) {
        const double own =
            k >= firstOfLeast && options.seeds > 1 ? 1 - 1.0 / double(options.seeds) : 1;
        rows[k]["true"]["noise"] = noise(lights[k], mean) / std::sqrt(own);
        out << rows[k].dump() << '\n';
    }
    out.flush();
}

}  // namespace
}  // namespace raybundle::bench

int main(int count, char** values) {
    using namespace raybundle::bench;
    return runCommand("calibrate", kUsage, count, values, [](const auto& arguments) {
        const Options options = parseOptions(arguments);
        std::ofstream file;
        if (!options.out.empty()) {
            file.open(options.out, std::ios::app);
            if (!file) throw raybundle::invalidArgument("cannot write " + options.out);
        }
        for (const std::string& scene : options.scenes)
            calibrate(scene, options, options.out.empty() ? std::cout : file);
        return 0;
    });
}
