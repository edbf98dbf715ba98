// SPDX-License-Identifier: GPL-3.0-or-later
//
// Final gather: the light that reaches a point from other surfaces and from the world, collected by
// rays from the point. A ray looks up the light that the patch it meets sends in the ray's
// direction.
//
// Source: Reichert, "A Two-Pass Radiosity Method Driven by Lights and Viewer Position" (1992), and
// Lischinski, Tampieri and Greenberg, "Combining Hierarchical Radiosity and Discontinuity Meshing"
// (1993): computing the last bounce at the shown points removes the blur of the patches and of
// their interpolation.
// Differs:
// - Light of the sources is left out, because DirectLight gathers it more accurately.
// - Light is gathered only where the interpolation differs from the light of the patches, or where
//   another surface is nearer than patches are wide and the face has too few patches to show
//   whether it differs. Elsewhere the interpolation is more accurate than rays, whose noise differs
//   from point to point.
// - If the distance of the surface that a ray meets is less than the width of the patch or cluster
//   there, the light of the sources and of the world is sampled at the end of the ray. The mean
//   over the patch is not the light that shines into a narrow gap. With more than four sources,
//   only some of these rays sample them, and count for the others.
// - The number of rays depends on the error. The receivers of a vertex share one sequence of Sobol
//   points, so that receivers with the same normal are stratified together. The spread of the parts
//   of this sequence gives the error.
#pragma once

#include <vector>

#include "direct_light/direct_light.h"
#include "patches/clusters.h"
#include "patches/lit_surfaces.h"
#include "reconstruction/least_squares.h"
#include "reconstruction/smooth_regions.h"
#include "sampling/sobol.h"
#include "transport/sent_light.h"
#include "transport/set_light.h"
#include "visibility/visibility.h"

namespace raybundle {

// Returns the RMS of the light of all baked sides, over the channels and the exposed area, W/m^2.
// `ranges` is per instance.
double meanLight(const Scene& scene, const LitSurfaces& surfaces,
                 const std::vector<InstanceRange>& ranges, const Irradiance& light);

// Gathers the light of one light set from other surfaces and from the world. All functions are
// const and may be called from several threads at once.
class FinalGather {
  public:
    // Prepares the final gather for `light`, the light of one light set or of what belongs to no
    // set. `irradiance` is that of `light`, or a sharper version of it. `meanLight` is the RMS of
    // this light over all baked sides, W/m^2. `targetError` is the relative error that is allowed.
    // References must outlive the object.
    FinalGather(const LitSurfaces& surfaces, const Visibility& visibility, const Clusters& clusters,
                const SetLight& light, const Irradiance& irradiance, float meanLight,
                float targetError);

    // Returns the argument of the constructor.
    float meanLight() const { return mean; }

    // Irradiance that arrives at a point, W/m^2, in two parts.
    struct Light {
        glm::vec3 carried{0.0f};  // from the world, and from emission that is not a source
        glm::vec3 reflected{0.0f};
        double variance = 0;  // of total(), mean over the channels, (W/m^2)^2; set only by gather()
        float open = 0;       // share of the rays that have met nothing, 0 to 1
        // Mean of the inverse distances of what the rays have met, 1/m; 0 for rays that meet
        // nothing. Not set by gather().
        float nearness = 0;
        glm::vec3 total() const { return carried + reflected; }
    };
    // What few rays find.
    struct Probe {
        glm::vec3 light{0.0f};  // mean, W/m^2
        double square = 0;      // mean of the squares of single rays and of the channels, (W/m^2)^2
        float open = 0, nearness = 0;  // as in Light

        // Returns whether the rays contradict the light `expected`, W/m^2, or the share
        // `expectedOpen` of the surroundings without surfaces. `allowed` is the squared error that
        // is allowed.
        bool contradicts(const glm::vec3& expected, float expectedOpen, double allowed) const;
    };
    // A receiver and its share in a mean. The receiver is not owned.
    struct Share {
        const Receiver* receiver;
        float share;
    };
    // Returns the mean light of the receivers, whose shares must sum to 1. `brightness` is the
    // light that the error is relative to, brightest channel, W/m^2: about all light there, or more
    // where that is dark. The error that is allowed is `laxity` times as large as usual. With
    // `followsOn`, each ray that meets a surface nearby is followed by one more ray, instead of
    // reading the mean of the reflected light that arrives there. This is more accurate beside
    // other surfaces, and has much more noise.
    Light gather(const std::vector<Share>& receivers, float brightness, float laxity = 1,
                 bool followsOn = false) const;
    // Returns what few rays find that start in turn from `count` receivers beside each other. The
    // estimate has much noise. It tells whether other light arrives than is expected, and how near
    // other surfaces are.
    Probe probe(const Receiver* const* receivers, size_t count) const;
    // Returns the standard error that gather() allows with this brightness and a laxity of 1,
    // W/m^2.
    float allowedError(const Receiver& receiver, float brightness) const;

    // Returns whether a surface is so near that the interpolation may not follow its light, while
    // the receiver's parent has too few patches to show it. A surface is near if its distance is
    // less than the width of its own patch, or less than twice the length of the receiver's patch.
    bool isNear(const Receiver& receiver) const;

    // Returns per node of an instance whether its light must be gathered, because the interpolation
    // differs too much from the light of the patches around the node. `carried` and `reflected` are
    // the two parts of the interpolated irradiance (see Light), per node, W/m^2.
    std::vector<bool> isWanted(const InstanceRange& range, const SmoothRegions& regions,
                               rb_side side, const std::vector<glm::vec3>& carried,
                               const std::vector<glm::vec3>& reflected) const;

  private:
    void addRays(const Receiver& receiver, const SobolPoints& points, uint32_t first,
                 uint32_t count, bool followsOn, Light& sum) const;
    // Returns an estimate by one ray of the irradiance at a point from the world and from emission
    // that is not a source, and of reflected light if `withReflected`, W/m^2. `u` holds two random
    // numbers.
    glm::vec3 sampleOne(const Receiver& at, const glm::vec2& u, bool withReflected) const;
    // Returns the square root of the area over which the light of a side is known, m: that of its
    // patch or cluster.
    float width(uint32_t side) const;

    const LitSurfaces surfaces;
    const Visibility& visibility;
    const Clusters& clusters;
    const SetLight& light;
    const Irradiance& irradiance;
    const std::vector<glm::vec3>& emission;  // per side, without sources, W/m^2
    const SentLight sent;
    const float nearShare;  // share of the rays that sample sources where they meet a near surface
    const glm::vec3 world;  // exitance of the world, W/m^2
    const float mean;       // see meanLight()
    const float targetError;
};

}  // namespace raybundle
