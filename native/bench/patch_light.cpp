// SPDX-License-Identifier: GPL-3.0-or-later
#include "patch_light.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>

#include "bake/error.h"

namespace raybundle::bench {
namespace {

// A side is unlit if its direct light is below this share of the scene's mean light.
constexpr float kUnlit = 0.01f;
constexpr char kMagic[8] = {'r', 'b', 'l', 'i', 'g', 'h', 't', '1'};

float sum(const glm::vec3& v) { return v.x + v.y + v.z; }

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
        const Instance& instance =
            scene.instances[patches.parents[patches.parentOf[side / 2]].instance];
        if (instance.role != RB_ROLE_BAKE || side % 2 != size_t(instance.side)) continue;
        light.area.push_back(patches.area[side / 2]);
        light.direct.push_back(irradiance.direct[side]);
        light.indirect.push_back(irradiance.indirect[side]);
    }
    const auto report = nlohmann::json::parse(bake.reportJson());
    light.bundles = report.at("bundles");
    light.estimatedError = report.at("estimated_error");
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
        area += double(reference.area[i]);
        mean += double(reference.area[i] * sum(reference.direct[i] + reference.indirect[i]));
    }
    const double darkest = double(kUnlit) * mean / area;

    LightError error;
    std::vector<std::pair<double, double>> differences;  // squared, and area
    double squares = 0, signal = 0, found = 0, wanted = 0;
    for (size_t i = 0; i < n; ++i) {
        if (part == Part::UNLIT && double(sum(reference.direct[i])) > darkest) continue;
        const double weight = double(reference.area[i]);
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
    // Whoever is interrupted leaves no half file under the name.
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
    read(file, light.direct, count);
    read(file, light.indirect, count);
    if (!file) throw invalidArgument("cannot read " + path);
    return light;
}

}  // namespace raybundle::bench
