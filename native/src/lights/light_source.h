// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light sources as the first shot sees them: points to sample, and where there is one the closed
// form of the irradiance without occluders. Sources: Lambert's formula for polygons;
// Blender's light units (addon/raybundle/light_export.py).
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

// What one sampled point of a source gives to a receiver if nothing is in between.
struct LightSample {
    glm::vec3 direction{0.0f};    // unit vector towards the sampled point
    float distance = 0;           // metres; infinite for suns
    glm::vec3 irradiance{0.0f};   // W/m^2, divided by the sample's probability; 0: receives nothing
    uint32_t part = 0;            // of the source, if it has any
    uint32_t parent = kNoParent;  // that the sampled point lies on, if the source is a mesh
    // This much before the point, along the ray, nothing blocks it any more, metres: what lies in
    // the plane of the source may stand before it by a rounding error.
    float margin = 0;

    // From the receiver's point.
    ShadowRay ray(const glm::vec3& point) const {
        return {point, direction, std::max(0.0f, distance - margin), parent};
    }
    // For a plane source of that normal and half thickness, metres.
    void setMargin(const glm::vec3& normal, float halfThickness) {
        margin = 2 * halfThickness / std::max(0.01f, -glm::dot(direction, normal));
    }
};

// A ray that leaves a source with an equal share of its power.
struct EmittedRay {
    glm::vec3 origin{0.0f}, direction{0.0f};
    glm::vec3 weight{1.0f};        // times the mean share, by channel
    glm::vec3 normal{0.0f};        // of the lamp's surface; zero if it has none
    std::optional<uint32_t> side;  // the patch side that it leaves, if its source is a mesh
    float from = 0;  // metres along the ray: surfaces before that get nothing, but block

    // The origin, moved off the lamp's surface.
    glm::vec3 start(float offset) const { return origin + offset * (direction + normal); }
};

struct PatchPoint {
    glm::vec3 point;
    float weight = 1;
};

// What becomes of the power of a source, as shares of it by channel.
struct PowerShares {
    glm::dvec3 escaped{0.0};  // meets no surface
    glm::dvec3 covered{0.0};  // stays between the source's surface and one that it touches
};

// Sample of a surface point `on` with normal onNormal and radiance towards the receiver; area: m^2
// per sample.
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

// Per part of a source.
using PartNeighbours = std::vector<std::vector<uint32_t>>;

class LightSource {
  public:
    virtual ~LightSource() = default;

    // Samples the source from a point with a unit normal; uv uniform in [0, 1)^2.
    virtual LightSample sample(const glm::vec3& point, const glm::vec3& normal,
                               glm::vec2 uv) const = 0;

    // The parts of the source, each of which may be visible or not (direct_light/outlook.h): of
    // each those that it touches. Empty: none are told apart.
    virtual const PartNeighbours& parts() const {
        static const PartNeighbours kNone;
        return kNone;
    }

    // Per part: the sum up to it of what a plane with that normal gets from it without occluders,
    // times the share of the part that is seen.
    virtual std::vector<float> sumOfSeen(const glm::vec3& /*normal*/,
                                         const std::vector<float>& /*seen*/) const {
        return {};
    }

    // A sample in proportion to that, of the same expectation.
    virtual LightSample sampleSeen(const glm::vec3& /*normal*/, glm::vec2 /*uv*/,
                                   const std::vector<float>& /*sumOfSeen*/) const {
        return {};
    }

    // Irradiance without occluders in closed form, W/m^2, if the source has one.
    virtual std::optional<glm::vec3> irradiance(const glm::vec3& point,
                                                const glm::vec3& normal) const = 0;

    // The same, as the mean over a patch, where the source knows that better than by points of it.
    virtual std::optional<glm::vec3> meanIrradiance(const ReceiverPlace& /*patch*/) const {
        return std::nullopt;
    }

    // Whether the points of a patch to look at its light from are those of placeOn, and not
    // uniform.
    virtual bool choosesPlaces() const { return false; }

    // Such a point, by uv uniform in [0, 1)^2, and what it counts for in the mean over the patch:
    // most of the light of a source close by arrives at few points of it.
    virtual PatchPoint placeOn(const ReceiverPlace& patch, glm::vec2 uv) const;

    // Whether no point of a receiver can get any of its light, occluders aside. False where that is
    // not certain.
    virtual bool isOutOfSight(const ReceiverPlace& place) const = 0;

    // A lower bound of the distance from a point to the source, metres.
    virtual float distance(const glm::vec3& point) const = 0;

    // A patch smaller than this share of its distance from the source needs one point of the closed
    // form only: the error is a quarter of the square of that, and of one sign under a lamp.
    virtual float farPatch() const { return 0.05f; }

    // Most shadow rays that a receiver needs.
    virtual int mostSamples() const { return 256; }

    // Whether it is so wide that anything near a receiver hides part of it, or most of it: that a
    // few samples agree means little then.
    virtual bool surrounds() const { return false; }

    // Whether its light stays within what it is part of, as that of the insides of a lamp's body:
    // it is not dark in there.
    virtual bool staysInside() const { return false; }

    // Emitted power, W; zero for sources whose power depends on where their light arrives: suns,
    // worlds, and disks that turn towards each receiver.
    virtual glm::vec3 power() const = 0;

    // Power of all that emit() gives, W, in a scene within a sphere of this radius around
    // Patches::centre.
    virtual glm::vec3 shootingPower(float /*sceneRadius*/) const { return power(); }

    // As messages have it: its kind and the name of the lamp or object.
    std::string name;
    // Whether surfaces stop its light. If not, it brings more than power() in all.
    bool castsShadows = true;
    // Whether many samples may miss it although it is seen.
    bool isNarrow = false;
    // What its light is proportional to, by channel, and all else that its light depends on (a
    // hash; not comparable between two geometries).
    glm::vec3 magnitude{1.0f};
    uint64_t shape = 0;

    // A ray of the source's light into such a scene; u uniform in [0, 1)^4. Not called when
    // shootingPower() is zero.
    virtual EmittedRay emit(const glm::vec4& u, float sceneRadius) const = 0;
};

// All sources of a light set whose light the first shot gathers: its lights, the image of the world
// if that is in it, and its emissive faces (lights/emissive_meshes.h).
std::vector<std::unique_ptr<LightSource>> lightSources(const Scene& scene, const Patches& patches,
                                                       const std::vector<bool>& gatheredSides,
                                                       const std::vector<glm::vec3>& emission,
                                                       int32_t lightSet = kNoLightSet);

}  // namespace raybundle
