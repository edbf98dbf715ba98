// SPDX-License-Identifier: GPL-3.0-or-later
#include "patch_light.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>

#include "direct_light/direct_light.h"
#include "job/error.h"
#include "lights/light_source.h"
#include "sampling/sobol.h"
#include "visibility/visibility.h"

namespace raybundle::bench {
namespace {

// A side is unlit if its direct light is below this share of the scene's mean light.
constexpr float kUnlit = 0.01f;
constexpr char kMagic[8] = {'r', 'b', 'l', 'i', 'g', 'h', 't', '1'};

// Settings of the reference. kMostSamples: samples per side and source if the source is partly
// visible; an eighth of them decides whether it is. Their number is that of the bundles, but at
// most this. kClosedSamples: points at which closed forms are evaluated.
constexpr uint32_t kMostSamples = 8192, kClosedSamples = 256;
// A surface no further away than this share of the patch size lies against a patch.
constexpr float kTouchOfPatch = 1e-3f;
// A seed that no compared bake has.
constexpr int kReferenceSeed = 1 << 30;
// Target error of the first shot GATHER of the reference bake. Its noise affects only the indirect
// light.
constexpr float kReferenceShotError = 0.002f;

float sum(const glm::vec3& v) { return v.x + v.y + v.z; }

// Returns whether the light of a side is part of a result.
bool isBaked(const Scene& scene, const Patches& patches, size_t side) {
    const Instance& instance =
        scene.instances[patches.parents[patches.parentOf[side / 2]].instance];
    return instance.role == RB_ROLE_BAKE && side % 2 == size_t(instance.side);
}

// Returns the mean irradiance of a side from a source, W/m^2. A visible or hidden part smaller than
// 8 / `samples` may be missed.
glm::dvec3 sampledIrradiance(const LightSource& source, const Patches& patches,
                             const Visibility& visibility, uint32_t side, uint32_t seed,
                             uint32_t samples) {
    const glm::vec3 normal = patches.normal(side);
    glm::dvec3 mean(0.0);
    uint32_t open = 0, blocked = 0, k = 0;
    for (; k < samples && (k < samples / 8 || (open > 0 && blocked > 0)); ++k) {
        const glm::vec4 u = sobolPoint(k, seed);
        const glm::vec3 point = patches.point(side / 2, {u.x, u.y});
        const LightSample sample = source.sample(point, normal, {u.z, u.w});
        if (!(sum(sample.irradiance) > 0)) continue;
        if (visibility.isBlocked(side, point, sample.direction, sample.distance)) {
            ++blocked;
        } else {
            ++open;
            mean += glm::dvec3(sample.irradiance);
        }
    }
    mean /= double(k);
    if (open == 0 || blocked > 0) return mean;
    // The source is fully visible. Its closed form, if there is one, has no noise.
    glm::dvec3 closedMean(0.0);
    for (k = 0; k < kClosedSamples; ++k) {
        const glm::vec4 u = sobolPoint(k, seed);
        const auto closed = source.irradiance(patches.point(side / 2, {u.x, u.y}), normal);
        if (!closed) return mean;
        closedMean += glm::dvec3(*closed);
    }
    return closedMean / double(kClosedSamples);
}

// Returns the share of a side against which no other surface lies.
float exposedShare(const Patches& patches, const Visibility& visibility, uint32_t side) {
    const float touching = kTouchOfPatch * patches.size;
    uint32_t open = 0;
    for (uint32_t k = 0; k < kClosedSamples; ++k) {
        const glm::vec4 u = sobolPoint(k, hash(uint32_t(kReferenceSeed), side));
        open += !visibility.isBlocked(side, patches.point(side / 2, {u.x, u.y}),
                                      patches.normal(side), touching);
    }
    return float(open) / float(kClosedSamples);
}

template <class T>
void write(std::ofstream& file, const std::vector<T>& values) {
    file.write(reinterpret_cast<const char*>(values.data()),
               std::streamsize(values.size() * sizeof(T)));
}

template <class T>
void read(std::ifstream& file, std::vector<T>& values, size_t count) {
    values.resize(count);
    file.read(reinterpret_cast<char*>(values.data()), std::streamsize(count * sizeof(T)));
}

}  // namespace

PatchLight patchLight(const Scene& scene, const Bake& bake) {
    const Patches& patches = bake.patches();
    const Irradiance& irradiance = bake.patchIrradiance();
    PatchLight light;
    for (size_t side = 0; side < patches.sideCount(); ++side) {
        if (!isBaked(scene, patches, side)) continue;
        light.area.push_back(patches.area[side / 2]);
        light.exposed.push_back(1);
        light.direct.push_back(irradiance.direct[side]);
        light.indirect.push_back(irradiance.indirect[side]);
    }
    const auto report = nlohmann::json::parse(bake.reportJson());
    light.bundles = report.at("bundles");
    light.estimatedError = report.at("estimated_error");
    return light;
}

PatchLight referenceLight(const Scene& scene, const Settings& like, int bundles) {
    Bake bake;
    bake.settings.patchSize = like.patchSize;
    bake.settings.maxPatches = like.maxPatches;
    bake.settings.contacts = like.contacts;
    bake.settings.minBundles = bake.settings.maxBundles = bundles;
    bake.settings.targetError = kReferenceShotError;
    bake.settings.seed = kReferenceSeed;
    bake.run(scene);
    PatchLight light = patchLight(scene, bake);

    // Replace the gathered part of the direct light by finer samples.
    const Patches& patches = bake.patches();
    const Visibility visibility(patches);
    const DirectLight directLight(scene, patches, visibility, uint32_t(kReferenceSeed));
    const auto& sources = directLight.lightSources();
    const uint32_t samples = std::min(kMostSamples, uint32_t(bundles));
    std::vector<uint32_t> sides;
    for (size_t side = 0; side < patches.sideCount(); ++side)
        if (isBaked(scene, patches, side)) sides.push_back(uint32_t(side));
    tbb::parallel_for(size_t(0), sides.size(), [&](size_t i) {
        const uint32_t side = sides[i];
        glm::dvec3 gathered(0.0);
        for (size_t k = 0; k < sources.size(); ++k)
            gathered +=
                sampledIrradiance(*sources[k], patches, visibility, side,
                                  hash(uint32_t(kReferenceSeed), hash(side, uint32_t(k))), samples);
        // All light arrives through the exposed part of the side.
        light.exposed[i] = exposedShare(patches, visibility, side);
        const double concentrated = light.exposed[i] > 0 ? 1 / double(light.exposed[i]) : 0;
        light.direct[i] +=
            glm::vec3(concentrated * gathered) - bake.patchIrradiance().ofSources[side];
    });
    return light;
}

LightError lightError(const PatchLight& light, const PatchLight& reference, Part part) {
    if (light.area != reference.area)
        throw invalidArgument(
            "the reference has other patches: it was made by another subdivision; remove it");
    const size_t n = light.size();
    auto value = [part](const PatchLight& of, size_t i) {
        return part == Part::INDIRECT ? of.indirect[i] : of.direct[i] + of.indirect[i];
    };
    double area = 0, mean = 0;
    for (size_t i = 0; i < n; ++i) {
        const float weight = reference.area[i] * reference.exposed[i];
        area += double(weight);
        mean += double(weight * sum(reference.direct[i] + reference.indirect[i]));
    }
    const double darkest = double(kUnlit) * mean / area;

    LightError error;
    std::vector<std::pair<double, double>> differences;  // squared difference, and area
    double squares = 0, signal = 0, found = 0, wanted = 0;
    for (size_t i = 0; i < n; ++i) {
        if (part == Part::UNLIT && double(sum(reference.direct[i])) > darkest) continue;
        const double weight = double(reference.area[i] * reference.exposed[i]);
        if (weight <= 0) continue;
        const glm::dvec3 x(value(light, i)), y(value(reference, i));
        const double squared = glm::dot(x - y, x - y);
        differences.emplace_back(squared, weight);
        squares += weight * squared;
        signal += weight * glm::dot(y, y);
        found += weight * (x.x + x.y + x.z);
        wanted += weight * (y.x + y.y + y.z);
        error.area += weight;
    }
    if (!(signal > 0)) return error;
    const double scale = std::sqrt(signal / error.area);
    error.noise = std::sqrt(squares / signal);
    error.bias = found / wanted - 1;
    std::sort(differences.begin(), differences.end());
    error.maximum = std::sqrt(differences.back().first) / scale;
    double below = 0;
    for (const auto& [squared, weight] : differences) {
        below += weight;
        if (below < 0.99 * error.area) continue;
        error.p99 = std::sqrt(squared) / scale;
        break;
    }
    return error;
}

void writePatchLight(const std::string& path, const PatchLight& light) {
    // Write to another name first, so that an interruption leaves no incomplete file under the
    // final name.
    const std::string partial = path + ".partial";
    {
        std::ofstream file(partial, std::ios::binary);
        const uint64_t count = light.size();
        file.write(kMagic, sizeof kMagic);
        file.write(reinterpret_cast<const char*>(&count), sizeof count);
        file.write(reinterpret_cast<const char*>(&light.bundles), sizeof light.bundles);
        file.write(reinterpret_cast<const char*>(&light.estimatedError),
                   sizeof light.estimatedError);
        write(file, light.area);
        write(file, light.exposed);
        write(file, light.direct);
        write(file, light.indirect);
        if (!file) throw invalidArgument("cannot write " + partial);
    }
    if (std::rename(partial.c_str(), path.c_str()) != 0)
        throw invalidArgument("cannot write " + path);
}

PatchLight readPatchLight(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    char magic[sizeof kMagic] = {};
    uint64_t count = 0;
    PatchLight light;
    file.read(magic, sizeof magic);
    file.read(reinterpret_cast<char*>(&count), sizeof count);
    file.read(reinterpret_cast<char*>(&light.bundles), sizeof light.bundles);
    file.read(reinterpret_cast<char*>(&light.estimatedError), sizeof light.estimatedError);
    if (!file || !std::equal(std::begin(magic), std::end(magic), std::begin(kMagic)))
        throw invalidArgument("cannot read " + path);
    read(file, light.area, count);
    read(file, light.exposed, count);
    read(file, light.direct, count);
    read(file, light.indirect, count);
    if (!file) throw invalidArgument("cannot read " + path);
    return light;
}

}  // namespace raybundle::bench
