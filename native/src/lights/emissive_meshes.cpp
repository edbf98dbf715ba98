// SPDX-License-Identifier: GPL-3.0-or-later
#include "lights/emissive_meshes.h"

#include <algorithm>
#include <array>
#include <map>
#include <tuple>

#include "lights/enclosing.h"
#include "lights/mesh_source.h"
#include "sampling/hasher.h"

namespace raybundle {
namespace {

// Largest number of connected surfaces of one object and material that are separate sources.
constexpr ptrdiff_t kMostOfObject = 32;

// Returns LightSource::shape of the fronts (back = 0) or the backs (back = 1) of emissive faces.
uint64_t shapeOf(const Patches& patches, const std::vector<uint32_t>& parents, uint32_t back,
                 const std::vector<glm::vec3>& emission, const glm::vec3& strength) {
    Hasher hasher;
    hasher.add(parents);
    hasher.add(back);
    for (uint32_t p : parents) {
        const Parent& parent = patches.parents[p];
        for (uint32_t k = 0; k < parent.patchCount(); ++k)
            for (int c = 0; c < 3; ++c) {
                const float e = emission[2 * (parent.firstPatch + k) + back][c];
                hasher.add(e > 0 ? e / strength[c] : 0.0f);
            }
    }
    return hasher.value();
}

// Joins the groups of an object and material that consists of more than kMostOfObject connected
// surfaces, such as a tree full of small lights. With fewer surfaces, each remains a source of its
// own, since a few samples of one joint source could not show how much light all lamps give
// together and which of them are hidden.
template <class Groups>
void joinMany(Groups& groups) {
    Groups joined;
    for (auto first = groups.begin(); first != groups.end();) {
        const auto [instance, material, surface] = first->first;
        const auto last = groups.upper_bound({instance, material, UINT32_MAX});
        const bool isOne = std::distance(first, last) > kMostOfObject;
        for (; first != last; ++first) {
            std::vector<uint32_t>& own =
                joined[{instance, material, isOne ? surface : std::get<2>(first->first)}];
            own.insert(own.end(), first->second.begin(), first->second.end());
        }
    }
    groups = std::move(joined);
}

}  // namespace

LightSources meshSources(const Scene& scene, const Patches& patches,
                         const std::vector<bool>& sourceSides,
                         const std::vector<glm::vec3>& emission, const DirectedEmission* directed) {
    LightSources sources;
    using Group = std::tuple<uint32_t, int32_t, uint32_t>;  // instance, material and surface
    std::map<Group, std::vector<uint32_t>> groups;
    for (size_t p = 0; p < patches.parents.size(); ++p) {
        const Parent& parent = patches.parents[p];
        const auto first = sourceSides.begin() + 2 * int64_t(parent.firstPatch);
        if (std::none_of(first, first + 2 * int64_t(parent.patchCount()),
                         [](bool isGathered) { return isGathered; }))
            continue;
        const Mesh& mesh = scene.meshes[scene.instances[parent.instance].mesh];
        groups[{parent.instance, mesh.faceMaterials[parent.face], parent.surface}].push_back(
            uint32_t(p));
    }
    joinMany(groups);
    const std::vector<Enclosing> surfaces =
        groups.empty() ? std::vector<Enclosing>() : enclosingSurfaces(patches);
    for (const auto& [key, parents] : groups) {
        std::array<glm::vec3, 2> most{glm::vec3(0.0f), glm::vec3(0.0f)};
        const uint32_t first = 2 * patches.parents[parents.front()].firstPatch;
        bool varies = false;
        for (uint32_t p : parents) {
            const Parent& parent = patches.parents[p];
            for (uint32_t k = 0; k < 2 * parent.patchCount(); ++k) {
                const uint32_t side = 2 * parent.firstPatch + k;
                most[k % 2] = glm::max(most[k % 2], emission[side]);
                varies = varies || emission[side] != emission[first + k % 2];
            }
        }
        // Fronts and backs are separate sources: of a lamp that encloses a volume, one of them is
        // never seen.
        Enclosing enclosing;
        for (uint32_t p : parents) enclosing.add(surfaces[patches.parents[p].surface]);
        for (uint32_t back = 0; back < 2; ++back) {
            if (most[back] == glm::vec3(0.0f)) continue;
            auto source = std::make_shared<MeshSource>(
                patches,
                EmissiveFaces{parents, back, most[back], varies || directed ? &emission : nullptr,
                              enclosing.box, enclosing.hides[back], directed});
            source->name = "object \"" + scene.instances[std::get<0>(key)].name + "\"";
            source->magnitude = most[back];
            source->shape = shapeOf(patches, parents, back, emission, most[back]);
            sources.push_back(std::move(source));
        }
    }
    return sources;
}

}  // namespace raybundle
