// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/first_light.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <memory>
#include <numeric>
#include <unordered_map>
#include <vector>

#include "direct_light/direct_light.h"
#include "job/cancellation.h"
#include "lights/light_source.h"
#include "patches/reflectance.h"
#include "patches/side.h"
#include "patches/whole_faces.h"
#include "sampling/sobol.h"
#include "sampling/sphere_sampling.h"

namespace raybundle {
namespace {

// With more rays than this, places near each other share the light of one, up to about kMostSharing
// of them.
constexpr size_t kManyRays = 60000, kMostSharing = 64;
// Faces share their light at a vertex if the cosine between their normals is larger than this.
constexpr float kSameWay = 0.9f;
// Where light at a vertex is sampled: on a face, at this share of the way from the vertex to the
// centroid. At the vertex itself, another face may touch.
constexpr float kInside = 0.1f;
// If an instance has more emissive sides than this, it takes too long to prepare them as sources.
constexpr size_t kMostEmissive = 30000;
// Rays to a world of constant radiance, per place.
constexpr uint32_t kSkyRays = 2;

// Where light is sampled: near corner `corner` of the cell of a patch.
struct Place {
    uint32_t patch, corner;
};

// The first light of one instance.
struct OfInstance {
    // Per corner of the mesh, the patch that the corner belongs to and the place whose light it
    // gets. kNoParent where the corner has no result.
    std::vector<uint32_t> patchOf, placeOf;
    std::vector<Place> places;
    std::vector<glm::vec3> irradiance;  // per place, W/m^2
};

// The first light of a scene, at the corners of its meshes.
class FirstLight {
  public:
    FirstLight(const Scene& scene, const Settings& settings)
        : scene(scene),
          seed(uint32_t(settings.seed)),
          patches(wholeFaces(scene)),
          visibility(patches, Blockers::STOPPING_DIRECT, Queries::FEW),
          ofInstances(scene.instances.size()) {
        if (patches.count() == 0) return;
        findSources();
        findPlaces();
        sample();
    }

    bool isDark() const {
        auto isBlack = [](const glm::vec3& light) { return light == glm::vec3(0.0f); };
        return std::all_of(ofInstances.begin(), ofInstances.end(), [&](const OfInstance& of) {
            return std::all_of(of.irradiance.begin(), of.irradiance.end(), isBlack);
        });
    }

    std::vector<InstanceLight> atCorners() const {
        std::vector<InstanceLight> result(ofInstances.size());
        parallelFor(size_t(0), result.size(), [&](size_t i) {
            const Instance& instance = scene.instances[i];
            const OfInstance& of = ofInstances[i];
            InstanceLight& out = result[i];
            out.name = instance.name;
            out.isBaked = instance.role == RB_ROLE_BAKE;
            out.direct.resize(of.patchOf.size());
            out.indirect.resize(of.patchOf.size());
            out.exitance.resize(of.patchOf.size());
            parallelFor(size_t(0), of.patchOf.size(), [&](size_t c) {
                const uint32_t patch = of.patchOf[c];
                if (patch == kNoParent) return;
                const uint32_t side = shownSide(patch);
                const float opacity = patches.opacityOf(patch);
                const glm::vec3 color = diffuseReflectance(scene, patches, side) +
                                        opacity * patches.translucenceOf(side);
                out.direct[c] = of.irradiance[of.placeOf[c]];
                out.exitance[c] = opacity * patches.emission[side] + color * out.direct[c];
            });
        });
        return result;
    }

  private:
    uint32_t shownSide(uint32_t patch) const {
        return sideOf(patch, scene.instances[patches.parents[patch].instance].side == RB_SIDE_BACK);
    }

    // Finds the sources of all light sets. Faces that emit are sources, except for those of
    // instances with too many of them.
    void findSources() {
        std::vector<size_t> emissive(scene.instances.size());  // sides
        if (scene.emits()) {
            emission = patches.emission;
            for (uint32_t side = 0; side < emission.size(); ++side) {
                emission[side] *= patches.opacityOf(patchOf(side));
                if (emission[side] != glm::vec3(0.0f)) ++emissive[patches.parentAt(side).instance];
            }
        }
        std::vector<bool> isSource(patches.sideCount());
        for (int32_t set = kNoLightSet; set < int32_t(scene.lightSets.size()); ++set) {
            sky += scene.worldRadianceOf(set);
            for (uint32_t side = 0; side < emission.size(); ++side) {
                const Parent& parent = patches.parentAt(side);
                isSource[side] = emission[side] != glm::vec3(0.0f) && parent.exchanges &&
                                 scene.instances[parent.instance].lightSet == set &&
                                 emissive[parent.instance] <= kMostEmissive;
            }
            for (auto& source : lightSources(scene, patches, isSource, emission, set))
                sources.push_back(std::move(source));
        }
    }

    // Finds the places whose light the corners get: at each vertex, one per direction of the faces
    // there.
    void findPlaces() {
        std::vector<uint32_t> first{0};
        for (const Instance& instance : scene.instances)
            first.push_back(first.back() +
                            uint32_t(triangleCount(scene.meshes[size_t(instance.mesh)])));
        parallelFor(size_t(0), scene.instances.size(), [&](size_t i) {
            const Instance& instance = scene.instances[i];
            if (instance.role != RB_ROLE_BAKE) return;
            const Mesh& mesh = scene.meshes[size_t(instance.mesh)];
            OfInstance& of = ofInstances[i];
            of.patchOf.resize(mesh.cornerCount(), kNoParent);
            of.placeOf.resize(mesh.cornerCount(), kNoParent);
            // Per vertex, the last place there.
            std::vector<uint32_t> atVertex(mesh.vertices.size(), kNoParent);
            for (uint32_t p = first[i]; p < first[i + 1]; ++p) {
                throwIfCancelledAt(p);
                const Cell& cell = patches.cells[p];
                if (!instance.hasResultOnFace(size_t(cell.face))) continue;
                for (uint32_t k = 0; k < 3; ++k) {
                    const size_t corner = size_t(cell.corner[k]);
                    uint32_t& place = atVertex[size_t(mesh.cornerVertices[corner])];
                    if (place == kNoParent || !faceAlike(of.places[place].patch, p)) {
                        place = uint32_t(of.places.size());
                        of.places.push_back({p, k});
                    }
                    of.patchOf[corner] = p;
                    of.placeOf[corner] = place;
                }
            }
        });
    }

    bool faceAlike(uint32_t patch, uint32_t other) const {
        return glm::dot(patches.parents[patch].normal, patches.parents[other].normal) > kSameWay;
    }

    // Sets the irradiance at all places.
    void sample() {
        const size_t each = sources.size() + (sky == glm::vec3(0.0f) ? 0 : kSkyRays);
        size_t count = 0;
        // Between an equal share for each place, which leaves too few samples for large surfaces,
        // and an equal share for each area, which leaves too few for small ones.
        std::vector<double> weights;
        for (const OfInstance& of : ofInstances) {
            count += of.places.size();
            weights.push_back(std::sqrt(areaOf(of.places) * double(of.places.size())));
        }
        const double all =
            double(std::max(kManyRays / std::max(each, size_t(1)), count / kMostSharing));
        const double perWeight =
            all / std::max(std::accumulate(weights.begin(), weights.end(), 0.0), 1e-30);
        parallelFor(size_t(0), ofInstances.size(), [&](size_t i) {
            OfInstance& of = ofInstances[i];
            of.irradiance.resize(of.places.size());
            const std::vector<uint32_t> sampled = sampledPlaces(of.places, perWeight * weights[i]);
            parallelFor(size_t(0), sampled.size(), [&](size_t k) {
                if (sampled[k] == k) of.irradiance[k] = sampleAt(of.places[k]);
            });
            for (size_t k = 0; k < sampled.size(); ++k)
                of.irradiance[k] = of.irradiance[sampled[k]];
        });
    }

    // Returns the area for which places stand, m^2. There are about twice as many triangles as
    // vertices.
    double areaOf(const std::vector<Place>& places) const {
        double area = 0;
        for (const Place& place : places) area += 2 * double(patches.area[place.patch]);
        return area;
    }

    // Returns for each place of an instance the place whose light it gets. About `count` places
    // have light of their own. Others share that of a place nearby, on a face that faces roughly
    // the same way.
    std::vector<uint32_t> sampledPlaces(const std::vector<Place>& places, double count) const {
        std::vector<uint32_t> sampled(places.size());
        std::iota(sampled.begin(), sampled.end(), 0u);
        if (count >= double(places.size())) return sampled;
        // Edge of the cubes in which light is shared, m. A surface meets about 1.5 cubes for each
        // square of this edge. A coordinate of a cube has 20 bits.
        const double square = 1.5 * areaOf(places) / std::max(count, 1.0);
        const float edge = std::max(
            {float(std::sqrt(square)), 2e-6f * patches.radius, std::numeric_limits<float>::min()});
        std::unordered_map<uint64_t, uint32_t> first;
        first.reserve(size_t(count));
        for (uint32_t k = 0; k < places.size(); ++k) {
            throwIfCancelledAt(k);
            const Parent& parent = patches.parents[places[k].patch];
            const glm::vec3 cube =
                glm::floor(patches.cells[places[k].patch].position(int(places[k].corner)) / edge);
            int axis = 0;
            for (int c = 1; c < 3; ++c)
                if (std::abs(parent.normal[c]) > std::abs(parent.normal[axis])) axis = c;
            uint64_t key = uint64_t(2 * axis + (parent.normal[axis] < 0));
            for (int c = 0; c < 3; ++c) key = key << 20 | uint64_t(int32_t(cube[c]) + (1 << 19));
            sampled[k] = first.try_emplace(key, k).first->second;
        }
        return sampled;
    }

    glm::vec3 sampleAt(const Place& place) const {
        const uint32_t side = shownSide(place.patch);
        const Cell& cell = patches.cells[place.patch];
        const glm::vec3 centroid = cell.origin + (cell.a + cell.b) / 3.0f;
        const glm::vec3 point = glm::mix(cell.position(int(place.corner)), centroid, kInside);
        const Receiver receiver{side, patches.normal(side), point, 4 * side + place.corner};
        glm::vec3 sum = sampleEach(sources, patches, visibility, receiver, 0, seed);
        for (uint32_t k = 0; k < kSkyRays && sky != glm::vec3(0.0f); ++k) {
            const glm::vec4 u = sobolPoint(k, hash(seed, receiver.seed));
            if (!visibility.isBlocked(side, point, cosineDirection(receiver.normal, {u.x, u.y}),
                                      std::numeric_limits<float>::infinity()))
                sum += glm::pi<float>() / float(kSkyRays) * sky;
        }
        return std::isfinite(sum.x + sum.y + sum.z) ? sum : glm::vec3(0.0f);
    }

    const Scene& scene;
    const uint32_t seed;
    const Patches patches;
    const Visibility visibility;
    // Per side, for the whole patch, W/m^2. Empty if there is none.
    std::vector<glm::vec3> emission;
    LightSources sources;
    glm::vec3 sky{0.0f};  // constant radiance of the world, W/(m^2 sr)
    std::vector<OfInstance> ofInstances;
};

}  // namespace

void offerFirstLight(const Scene& scene, const Settings& settings, Interim& interim) {
    if (!interim.wantsLight()) return;
    const FirstLight light(scene, settings);
    if (!light.isDark()) interim.offer([&] { return light.atCorners(); });
}

}  // namespace raybundle
