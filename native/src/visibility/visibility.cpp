// SPDX-License-Identifier: GPL-3.0-or-later
#include "visibility/visibility.h"

#include <tbb/task.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "job/cancellation.h"
#include "job/error.h"
#include "patches/opacity.h"
#include "patches/side.h"
#include "visibility/embree_device.h"
#include "visibility/ray_query.h"

namespace raybundle {
namespace {

[[noreturn]] void fail(RTCError code, const char* what) {
    // If an allocation fails in one of several threads that build a tree, Embree only reports that
    // the build was cancelled, as RTC_ERROR_UNKNOWN. Nothing else can fail in a build.
    const bool isMemory = code == RTC_ERROR_OUT_OF_MEMORY || code == RTC_ERROR_UNKNOWN;
    throw Error(isMemory                            ? RB_ERROR_OUT_OF_MEMORY
                : code == RTC_ERROR_UNSUPPORTED_CPU ? RB_ERROR_UNSUPPORTED_HARDWARE
                                                    : RB_ERROR_UNKNOWN,
                std::string("the ray tracer Embree could not ") + what +
                    (isMemory                            ? ": out of memory"
                     : code == RTC_ERROR_UNSUPPORTED_CPU ? ": it does not support this processor"
                                                         : ""));
}

}  // namespace

Visibility::Visibility(const Patches& patches, Blockers blockers, Queries queries)
    : patches(patches),
      surfaceOffset(kRelativeOffset * patches.radius),
      embree(std::make_unique<Embree>()) {
    embree->device = newEmbreeDevice();
    if (!embree->device) fail(embree3.getDeviceError(nullptr), "create a device");
    embree->scene = embree3.newScene(embree->device);
    if (!embree->scene) fail(embree3.getDeviceError(embree->device), "create a scene");
    // Robust, so that rays do not slip between neighbouring triangles.
    embree3.setSceneFlags(embree->scene,
                          RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    if (queries == Queries::FEW) embree3.setSceneBuildQuality(embree->scene, RTC_BUILD_QUALITY_LOW);

    auto blocks = [&](const Parent& parent) {
        return blockers == Blockers::EXCHANGING ? parent.exchanges : parent.stopsDirect;
    };
    for (size_t i = 0; i < patches.parents.size(); ++i)
        if (blocks(patches.parents[i])) embree->parentOf.push_back(uint32_t(i));
    const size_t quads = embree->parentOf.size();
    if (quads > 0) {
        const std::unique_ptr<RTCGeometryTy, decltype(&rtcReleaseGeometry)> made(
            embree3.newGeometry(embree->device, RTC_GEOMETRY_TYPE_QUAD), embree3.releaseGeometry);
        const RTCGeometry geometry = made.get();
        if (!geometry) fail(embree3.getDeviceError(embree->device), "create a geometry");
        float* vertices = static_cast<float*>(
            embree3.setNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                         3 * sizeof(float), patches.vertices.size()));
        uint32_t* indices = static_cast<uint32_t*>(embree3.setNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(uint32_t), quads));
        if (!vertices || !indices)
            fail(embree3.getDeviceError(embree->device), "create its buffers");
        std::memcpy(vertices, patches.vertices.data(), patches.vertices.size() * sizeof(glm::vec3));
        parallelFor(size_t(0), quads, [&](size_t quad) {
            const Parent& parent = patches.parents[embree->parentOf[quad]];
            // A triangle is stored as a quad whose last corner is repeated.
            for (size_t k = 0; k < 4; ++k)
                indices[4 * quad + k] = parent.vertex[parent.isTriangle && k == 3 ? 2 : k];
        });
        if (queries == Queries::FEW)
            embree3.setGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_LOW);
        embree3.commitGeometry(geometry);
        embree3.attachGeometry(embree->scene, geometry);
    }
    embree->build(queries);
    const RTCError error = embree3.getDeviceError(embree->device);
    if (error != RTC_ERROR_NONE) fail(error, "build its tree");
}

Visibility::~Visibility() = default;

// The threads of the builder for few queries wait for each other without sleeping, so that the
// build takes five times as long when two of them get the same processor. One is left free.
void Visibility::Embree::build(Queries queries) {
    // The context of the build is not that of the bake, so Embree asks whether to go on.
    tbb::task_group_context* const bake = tbb::task::current_context();
    embree3.setSceneProgressMonitorFunction(
        scene,
        [](void* context, double) {
            return !context ||
                   !static_cast<tbb::task_group_context*>(context)->is_group_execution_cancelled();
        },
        bake);
    const auto commit = [&] {
        tbb::task_group(building).run_and_wait([&] { embree3.commitScene(scene); });
    };
    if (queries == Queries::FEW)
        tbb::task_arena(std::max(1, tbb::this_task_arena::max_concurrency() - 1)).execute(commit);
    else
        commit();
    embree3.setSceneProgressMonitorFunction(scene, nullptr, nullptr);
}

struct Visibility::FromSide : SideQuery {
    FromSide(const Visibility& visibility, uint32_t side)
        : SideQuery(visibility.patches, visibility.embree->parentOf.data()) {
        context.filter = passStart;
        const Patches& patches = visibility.patches;
        parent = patches.parentOf[patchOf(side)];
        isFront = !isBack(side);
        normal = patches.normal(side);
        zone = 2 * offsetAt(patches, parent);
        target.fill(kNoParent);
        lastPart.fill(std::numeric_limits<float>::infinity());
        const Parent& own = patches.parents[parent];
        isInside = own.isSolid && !own.isInward && !isFront;
    }
    bool isInside;  // whether the rays leave into a solid, which may stand on a target

    // Moves the start of a ray slightly behind the surface, so that the ray meets surfaces that
    // coincide with it. The shift is along the ray, not along the normal, so that the ray still
    // passes through the point.
    glm::vec3 origin(const glm::vec3& point, const glm::vec3& direction, size_t id = 0) {
        behind[id] = 0.5f * zone / std::max(0.01f, glm::dot(direction, normal));
        return point - behind[id] * direction;
    }
    // Sets a shadow ray. Returns false if the ray is so short that nothing can lie in between.
    bool setShadowRay(RTCRay& ray, const ShadowRay& shadow, size_t id = 0) {
        const glm::vec3 from = origin(shadow.point, shadow.direction, id);
        if (std::isfinite(shadow.distance)) {
            // Aim at the far end from the shifted origin, or the ray would pass beside it.
            const glm::vec3 segment = shadow.point + shadow.distance * shadow.direction - from;
            const float length = glm::length(segment);
            // The rounding error of the far end grows with its distance.
            const float end = std::max(zone, kRelativeOffset * length);
            if (length <= end) return false;
            setRay(ray, from, segment / length, length - end);
            // A solid that stands on the target covers it at the far end or beyond it. Only rays
            // from the inside of the solid meet nothing of it before.
            if (isInside && shadow.target != kNoParent && ray.tfar >= 0) {
                context.filter = passStartAndEnd;
                lastPart[id] = ray.tfar;
                ray.tfar = length + shadow.margin + end;
            }
        } else {
            setRay(ray, from, shadow.direction, shadow.distance);
        }
        ray.id = uint32_t(id);
        target[id] = shadow.target;
        return true;
    }
};

float Visibility::visibleShare(uint32_t side, const ShadowRay& shadow) const {
    FromSide start(*this, side);
    RTCRay ray{};
    if (!start.setShadowRay(ray, shadow)) return 1;
    embree3.occluded1(embree->scene, &start.context, &ray);
    start.passage.passed.check();
    return ray.tfar < 0 ? 0.0f : start.passage.share;
}

void Visibility::visibleShares(uint32_t side, const ShadowRay* rays, int count,
                               float* shares) const {
    // A SideQuery has one Passage, so it can follow only one ray through surfaces that let light
    // through.
    if (!patches.opacity.empty() || count == 1) {
        for (int k = 0; k < count; ++k) shares[k] = visibleShare(side, rays[k]);
        return;
    }
    FromSide start(*this, side);
    start.context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    // Without kernels for eight rays (on processors without AVX), Embree also follows the invalid
    // rays of a packet. These are set to end before they start.
    alignas(32) int valid[kPacket] = {};
    RTCRay8 packet{};
    std::fill_n(packet.dir_z, kPacket, 1.0f);
    std::fill_n(packet.tfar, kPacket, -1.0f);
    std::array<bool, kPacket> isShort{};
    for (int k = 0; k < count; ++k) {
        RTCRay ray{};
        isShort[size_t(k)] = !start.setShadowRay(ray, rays[k], size_t(k));
        if (isShort[size_t(k)]) continue;
        valid[k] = -1;
        packet.org_x[k] = ray.org_x;
        packet.org_y[k] = ray.org_y;
        packet.org_z[k] = ray.org_z;
        packet.dir_x[k] = ray.dir_x;
        packet.dir_y[k] = ray.dir_y;
        packet.dir_z[k] = ray.dir_z;
        packet.tnear[k] = ray.tnear;
        packet.tfar[k] = ray.tfar;
        packet.time[k] = 0;
        packet.mask[k] = ray.mask;
        packet.id[k] = ray.id;
        packet.flags[k] = 0;
    }
    embree3.occluded8(valid, embree->scene, &start.context, &packet);
    for (int k = 0; k < count; ++k)
        shares[k] = isShort[size_t(k)] || packet.tfar[k] >= 0 ? 1.0f : 0.0f;
}

// `point` lies on the parent.
uint32_t Visibility::sideOf(uint32_t parent, const glm::vec3& point,
                            const glm::vec3& direction) const {
    const bool front = glm::dot(patches.parents[parent].normal, direction) < 0;
    return 2 * patches.patchAt(parent, point) + (front ? 0 : 1);
}

std::optional<uint32_t> Visibility::firstHit(uint32_t side, const glm::vec3& point,
                                             const glm::vec3& direction, float* distance,
                                             float farthest) const {
    FromSide start(*this, side);
    const glm::vec3 origin = start.origin(point, direction);
    if (!patches.opacity.empty()) start.passage.line = lineName(origin, direction);
    start.context.filter = meetAfterStart;
    RTCRayHit query{};
    setRay(query.ray, origin, direction, farthest + start.behind[0]);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    embree3.intersect1(embree->scene, &start.context, &query);
    const NearestHit& nearest = start.nearest;
    if (nearest.parent == kNoParent) return std::nullopt;
    if (distance) *distance = std::max(0.0f, nearest.distance - glm::length(point - origin));
    // The order of surfaces that coincide with the start was settled by the filter.
    const bool isAtStart = nearest.distance * glm::dot(direction, start.normal) <= 2 * start.zone;
    return sideOf(isAtStart ? nearest.parent : nearest.first(patches, direction),
                  origin + nearest.distance * direction, direction);
}

std::optional<uint32_t> Visibility::firstHit(const glm::vec3& origin, const glm::vec3& direction,
                                             float* distance) const {
    RayQuery from(patches, embree->parentOf.data());
    from.context.filter = meetFirst;
    if (!patches.opacity.empty()) from.passage.line = lineName(origin, direction);
    RTCRayHit query{};
    setRay(query.ray, origin, direction, std::numeric_limits<float>::infinity());
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    embree3.intersect1(embree->scene, &from.context, &query);
    const NearestHit& nearest = from.nearest;
    if (nearest.parent == kNoParent) return std::nullopt;
    if (distance) *distance = nearest.distance;
    return sideOf(nearest.first(patches, direction), origin + nearest.distance * direction,
                  direction);
}

}  // namespace raybundle
