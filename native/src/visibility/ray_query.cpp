// SPDX-License-Identifier: GPL-3.0-or-later
#include "visibility/ray_query.h"

#include "patches/coincidence.h"
#include "patches/opacity.h"

namespace raybundle {
namespace {

// The ray of a hit that Embree reports, and the point that it hits.
struct Hit {
    explicit Hit(const RTCFilterFunctionNArguments* args, uint32_t k = 0)
        : direction(RTCRayN_dir_x(args->ray, args->N, k), RTCRayN_dir_y(args->ray, args->N, k),
                    RTCRayN_dir_z(args->ray, args->N, k)),
          distance(RTCRayN_tfar(args->ray, args->N, k)),
          point(glm::vec3(RTCRayN_org_x(args->ray, args->N, k),
                          RTCRayN_org_y(args->ray, args->N, k),
                          RTCRayN_org_z(args->ray, args->N, k)) +
                distance * direction) {}

    const glm::vec3 direction;
    const float distance;
    const glm::vec3 point;
};

// Records a hit of a ray that searches for the first surface.
void meet(RayQuery& query, const RTCFilterFunctionNArguments* args, uint32_t parent,
          const Hit& hit) {
    const float cosine =
        std::abs(glm::dot(query.passage.patches->parents[parent].normal, hit.direction));
    RTCRayN_tfar(args->ray, args->N, 0) =
        query.nearest.meet(parent, hit.distance,
                           2 * offsetAt(*query.passage.patches, parent) / std::max(0.01f, cosine));
}

// Returns whether a ray passes a surface near its start: the surface that it leaves, surfaces that
// coincide with this one on its other side, and surfaces that the ray meets behind its start, such
// as the next face of a box whose edge is near.
bool passesStart(const SideQuery& start, uint32_t other, const glm::vec3& direction, float distance,
                 float behind) {
    if (other == start.parent) return true;
    const float height = distance * glm::dot(direction, start.normal);
    if (height > start.zone) return false;
    const Patches& patches = *start.passage.patches;
    const Parent& a = patches.parents[start.parent];
    const Parent& b = patches.parents[other];
    if (distance < behind && !areParallel(a, b)) return true;
    const float turn = glm::dot(glm::cross(b.a, b.b), direction);
    // Faces of the same object that the ray crosses in the same direction lie beside its start.
    // Faces of other objects that coincide with the start may lie behind it.
    const bool alike = a.instance == b.instance && (turn > 0) == start.isFront;
    return alike || (areParallel(a, b) &&
                     !comesBefore(patches, start.parent, !start.isFront, other, turn < 0));
}

// Returns whether a ray passes a parent that it hits. `id` is the index of the ray in its packet.
bool goesOn(SideQuery& start, uint32_t id, uint32_t other, const Hit& hit) {
    return other == start.target[id] ||
           passesStart(start, other, hit.direction, hit.distance, start.behind[id]) ||
           start.passage.goesOn(other, hit.point);
}

// Returns whether a surface at the end of a shadow ray covers the target: one through which the ray
// leaves a solid that stands on the target. It comesBefore the target (patches/coincidence.h).
bool coversTarget(const SideQuery& start, uint32_t id, uint32_t other, const glm::vec3& direction) {
    const Patches& patches = *start.passage.patches;
    const Parent &cover = patches.parents[other], &target = patches.parents[start.target[id]];
    auto leavesSolid = [&](const Parent& parent) {
        return parent.isSolid && glm::dot(parent.normal, direction) > 0;
    };
    return leavesSolid(cover) && !leavesSolid(target) && areParallel(cover, target);
}

// Returns whether the squares of a vector's components are well within the range of floats. For
// other rays, including those of NaN, Embree's assertions would end the process. setRay() makes
// them meet nothing; shadow rays of this kind count as blocked.
bool isValid(const glm::vec3& v) {
    constexpr float kMost = 1e18f;
    return std::abs(v.x) < kMost && std::abs(v.y) < kMost && std::abs(v.z) < kMost;
}

}  // namespace

bool Passage::goesOn(uint32_t parent, const glm::vec3& point) {
    if (patches->opacity.empty()) return false;
    const uint32_t patch = patches->patchAt(parent, point);
    const float opacity = patches->opacity[patch];
    if (opacity >= 1) return false;
    if (line) return !stops(*patches, patch, *line);
    if (!passed.has(parent)) {
        passed.add(parent);
        share *= 1 - opacity;
    }
    return share > 0;
}

float NearestHit::meet(uint32_t other, float at, float otherZone) {
    if (parent == kNoParent || at < distance) {
        if (parent != kNoParent && distance <= at + otherZone) keep({parent, distance});
        parent = other;
        distance = at;
        zone = otherZone;
    } else if (at <= distance + zone) {
        keep({other, at});
    }
    return distance + zone;
}

void NearestHit::keep(const Other& other) {
    if (count == others.size()) {
        // Remove hits that are farther than a nearer hit that was found in the meantime.
        const auto isFar = [&](const Other& o) { return o.distance > distance + zone; };
        count = size_t(std::remove_if(others.begin(), others.end(), isFar) - others.begin());
    }
    if (count < others.size()) others[count++] = other;
}

uint32_t NearestHit::first(const Patches& patches, const glm::vec3& direction) const {
    uint32_t result = parent;
    auto enters = [&](uint32_t k) { return glm::dot(patches.parents[k].normal, direction) < 0; };
    for (size_t k = 0; k < count; ++k) {
        const auto& [other, at] = others[k];
        if (other != result && at <= distance + zone &&
            areParallel(patches.parents[result], patches.parents[other]) &&
            comesBefore(patches, other, enters(other), result, enters(result)))
            result = other;
    }
    return result;
}

void passStart(const RTCFilterFunctionNArguments* args) {
    SideQuery& start = *reinterpret_cast<SideQuery*>(args->context);
    for (uint32_t k = 0; k < args->N; ++k) {
        if (args->valid[k] == 0) continue;
        const uint32_t other = start.passage.parentOf[RTCHitN_primID(args->hit, args->N, k)];
        if (goesOn(start, RTCRayN_id(args->ray, args->N, k), other, Hit(args, k)))
            args->valid[k] = 0;
    }
}

void passStartAndEnd(const RTCFilterFunctionNArguments* args) {
    SideQuery& start = *reinterpret_cast<SideQuery*>(args->context);
    for (uint32_t k = 0; k < args->N; ++k) {
        if (args->valid[k] == 0) continue;
        const uint32_t other = start.passage.parentOf[RTCHitN_primID(args->hit, args->N, k)];
        const uint32_t id = RTCRayN_id(args->ray, args->N, k);
        const Hit hit(args, k);
        const bool isAtEnd = hit.distance > start.lastPart[id];
        if (goesOn(start, id, other, hit) ||
            (isAtEnd && !coversTarget(start, id, other, hit.direction)))
            args->valid[k] = 0;
    }
}

void meetAfterStart(const RTCFilterFunctionNArguments* args) {
    SideQuery& start = *reinterpret_cast<SideQuery*>(args->context);
    const uint32_t other = start.passage.parentOf[RTCHitN_primID(args->hit, args->N, 0)];
    const Hit hit(args);
    if (goesOn(start, 0, other, hit))
        args->valid[0] = 0;
    else
        meet(start, args, other, hit);
}

void meetFirst(const RTCFilterFunctionNArguments* args) {
    RayQuery& query = *reinterpret_cast<RayQuery*>(args->context);
    const uint32_t parent = query.passage.parentOf[RTCHitN_primID(args->hit, args->N, 0)];
    const Hit hit(args);
    if (query.passage.goesOn(parent, hit.point))
        args->valid[0] = 0;
    else
        meet(query, args, parent, hit);
}

void setRay(RTCRay& ray, glm::vec3 origin, glm::vec3 direction, float length) {
    if (!isValid(origin) || !isValid(direction)) {
        origin = glm::vec3(0.0f);
        direction = glm::vec3(0, 0, 1);
        length = -1;
    }
    ray.org_x = origin.x;
    ray.org_y = origin.y;
    ray.org_z = origin.z;
    ray.dir_x = direction.x;
    ray.dir_y = direction.y;
    ray.dir_z = direction.z;
    ray.tnear = 0;
    ray.tfar = length;
    ray.mask = ~0u;
    ray.id = 0;
}

}  // namespace raybundle
