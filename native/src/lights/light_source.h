// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light sources as the first shot uses them: each source can be sampled by points, and some have a
// closed form of the irradiance without occluders.
//
// Sources: Lambert's formula for polygons; Blender's light units (addon/raybundle/light_export.py).
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lights/directed_emission.h"
#include "lights/shadow_ray.h"
#include "patches/patches.h"
#include "patches/plane.h"
#include "scene/scene.h"

namespace raybundle {

struct ReceiverPlace;

// One sampled point of a source, and the irradiance that it gives to a receiver without occluders.
struct LightSample {
    glm::vec3 direction{0.0f};  // unit vector towards the sampled point
    float distance = 0;         // metres; infinite for suns and worlds
    // W/m^2, divided by the probability of the sample; 0 if the receiver gets no light.
    glm::vec3 irradiance{0.0f};
    uint32_t part = 0;            // of the source that the point lies in, if the source has parts
    uint32_t parent = kNoParent;  // parent that contains the point, if the source is a mesh
    // Length of the last part of the ray on which nothing blocks it, metres. Surfaces in the plane
    // of the source may lie in front of the sampled point by a rounding error.
    float margin = 0;

    // Returns the shadow ray from the receiver's point to the sampled point.
    ShadowRay ray(const glm::vec3& point) const {
        return {point, direction, std::max(0.0f, distance - margin), parent, margin};
    }
    // Sets the margin for a planar source with the given normal (unit) and half thickness (metres).
    void setMargin(const glm::vec3& normal, float halfThickness) {
        margin = 2 * halfThickness / std::max(0.01f, -glm::dot(direction, normal));
    }
};

// A ray that leaves a source. All rays of a source carry equal shares of its power, times `weight`.
struct EmittedRay {
    glm::vec3 origin{0.0f}, direction{0.0f};
    glm::vec3 weight{1.0f};        // factor on the mean share, by channel
    glm::vec3 normal{0.0f};        // unit normal of the lamp's surface; zero if it has none
    std::optional<uint32_t> side;  // patch side that the ray leaves, if the source is a mesh
    // Distance along the ray, metres. Surfaces nearer than that receive nothing, but block the ray.
    float from = 0;

    // Returns the origin moved off the lamp's surface. `offset` is in metres.
    glm::vec3 start(float offset) const { return origin + offset * (direction + normal); }
};

// A point of a patch, metres relative to Patches::centre, and its weight in the mean over the
// patch.
struct PatchPoint {
    glm::vec3 point;
    float weight = 1;
};

// The fractions of a source's power that reach no receiver, by channel, 0 to 1.
struct PowerShares {
    glm::dvec3 escaped{0.0};  // leaves the scene without meeting a surface
    glm::dvec3 covered{0.0};  // stays between the source's surface and one that it touches
};

// Returns the sample of a point `on` of a surface with the unit normal `onNormal`, seen from
// `point` with the unit normal `normal`. `radiance` leaves `on` towards the receiver, W/(m^2 sr).
// `area` is the area of the surface that one sample stands for, m^2.
inline LightSample surfaceSample(const glm::vec3& point, const glm::vec3& normal,
                                 const glm::vec3& on, const glm::vec3& onNormal,
                                 const glm::vec3& radiance, float area) {
    LightSample sample;
    const glm::vec3 d = on - point;
    const float distance2 = glm::dot(d, d);
    if (distance2 <= 0) return sample;
    sample.distance = std::sqrt(distance2);
    sample.direction = d / sample.distance;
    const float cosReceiver = glm::dot(normal, sample.direction);
    const float cosSource = -glm::dot(onNormal, sample.direction);
    if (cosReceiver > 0 && cosSource > 0)
        sample.irradiance = radiance * (area * cosReceiver * cosSource / distance2);
    return sample;
}

// For each part of a source, the indices of the parts that touch it.
using PartNeighbours = std::vector<std::vector<uint32_t>>;

// Base class of all light sources. Positions are in metres relative to Patches::centre.
class LightSource {
  public:
    virtual ~LightSource() = default;

    // Returns a sample of the source as seen from a point with a unit normal. `uv` is uniform in
    // [0, 1)^2.
    virtual LightSample sample(const glm::vec3& point, const glm::vec3& normal,
                               glm::vec2 uv) const = 0;

    // Returns a sample where it is the only one for this normal. It has the expectation of sample()
    // and may have more noise, but a source need not prepare for more samples.
    virtual LightSample sampleAlone(const glm::vec3& point, const glm::vec3& normal,
                                    glm::vec2 uv) const {
        return sample(point, normal, uv);
    }

    // Returns for each part of the source the parts that touch it. Each part may be visible or not
    // (direct_light/outlook.h). Empty if the source is not divided into parts.
    virtual const PartNeighbours& parts() const {
        static const PartNeighbours kNone;
        return kNone;
    }

    // Returns cumulative sums over the parts of the source: of each part's irradiance without
    // occluders on a plane with the unit normal `normal`, times the part's entry in `seen`. `seen`
    // has one weight per part. Empty if the source has no parts.
    virtual std::vector<float> sumOfSeen(const glm::vec3& /*normal*/,
                                         const std::vector<float>& /*seen*/) const {
        return {};
    }

    // Returns a sample whose part is chosen in proportion to its share of `sumOfSeen`. The
    // expectation is the same as that of sample().
    virtual LightSample sampleSeen(const glm::vec3& /*normal*/, glm::vec2 /*uv*/,
                                   const std::vector<float>& /*sumOfSeen*/) const {
        return {};
    }

    // Returns the irradiance without occluders at a point with a unit normal, W/m^2. Empty if the
    // source has no closed form there.
    virtual std::optional<glm::vec3> irradiance(const glm::vec3& point,
                                                const glm::vec3& normal) const = 0;

    // Returns the mean irradiance without occluders over a patch, W/m^2. Empty unless the source
    // has a formula that is better than the mean of irradiance() over points of the patch.
    virtual std::optional<glm::vec3> meanIrradiance(const ReceiverPlace& /*patch*/) const {
        return std::nullopt;
    }

    // Returns whether the light may end within a patch, or change so steeply there that the mean of
    // irradiance() over a few points in rows is off.
    virtual bool isSteepOn(const ReceiverPlace& /*patch*/) const { return false; }

    // Returns whether samples on a patch must start at the points that placeOn() returns instead of
    // points that are uniform by area.
    virtual bool choosesPlaces() const { return false; }

    // Returns a point of a patch, and its weight in the mean over the patch. `uv` is uniform in
    // [0, 1)^2. A source close by needs this because most of its light arrives at a small part of
    // the patch.
    virtual PatchPoint placeOn(const ReceiverPlace& patch, glm::vec2 uv) const;

    // Returns whether no point of a receiver can get light from the source, occluders aside.
    // Returns false if that is not certain.
    virtual bool isOutOfSight(const ReceiverPlace& place) const = 0;

    // Returns a lower bound of the distance between a point and the source, metres.
    virtual float distance(const glm::vec3& point) const = 0;

    // Returns the ratio of a patch's size to its distance from the source below which one point of
    // the closed form suffices. The relative error is a quarter of the square of this ratio. Under
    // a lamp it has the same sign everywhere.
    virtual float farPatch() const { return 0.05f; }

    // Returns the largest number of shadow rays that a receiver takes.
    virtual int mostSamples() const { return 256; }

    // Returns whether the source is so wide that any object near a receiver hides a part of it, or
    // most of it. If so, a few samples that agree prove little.
    virtual bool surrounds() const { return false; }

    // Returns whether the light of the source stays inside the closed surface that the source is
    // part of, like that of the inner sides of a lamp's body. The inside of this surface is then
    // not dark.
    virtual bool staysInside() const { return false; }

    // Returns the emitted power, W. Zero for sources whose power depends on where their light
    // arrives: suns, worlds, and disks that turn towards each receiver.
    virtual glm::vec3 power() const = 0;

    // Returns the power of all rays that emit() returns, W, for a scene inside a sphere of this
    // radius (metres) around Patches::centre.
    virtual glm::vec3 shootingPower(float /*sceneRadius*/) const { return power(); }

    // The kind and the name of the lamp or object, as used in messages.
    std::string name;
    // Whether surfaces stop the light. If not, the source brings more light than power() in all.
    bool castsShadows = true;
    // Whether most samples of a source can be zero although the source is visible.
    bool isNarrow = false;
    // `magnitude` is the factor, by channel, that the light is proportional to. `shape` is a hash
    // of everything else that the light depends on; hashes of different geometries are not
    // comparable.
    glm::vec3 magnitude{1.0f};
    uint64_t shape = 0;

    // Returns a ray of the source's light into a scene of this radius (metres). `u` is uniform in
    // [0, 1)^4. Must not be called if shootingPower() is zero.
    virtual EmittedRay emit(const glm::vec4& u, float sceneRadius) const = 0;
};

// Sources are shared where it takes long to make them (lights/world_source.h).
using LightSources = std::vector<std::shared_ptr<const LightSource>>;

// Returns all sources of a light set whose light the first shot gathers: the lamps, the image of
// the world if it is in the light set, and the emissive faces (lights/emissive_meshes.h).
// `sourceSides` marks the patch sides that are light sources; `emission` is per patch side,
// W/m^2. `scene`, `patches` and `emission` must outlive the sources.
LightSources lightSources(const Scene& scene, const Patches& patches,
                          const std::vector<bool>& sourceSides,
                          const std::vector<glm::vec3>& emission, int32_t lightSet = kNoLightSet);

}  // namespace raybundle
