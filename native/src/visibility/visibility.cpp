// SPDX-License-Identifier: GPL-3.0-or-later
#include "visibility/visibility.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <vector>

#include "job/error.h"
#include "patches/coincidence.h"
#include "patches/opacity.h"
#include "visibility/embree3.h"
#include "visibility/embree_device.h"

namespace raybundle {
namespace {

// Share of how far an island reaches: some tens of float rounding errors.
constexpr float kRelativeOffset = 2e-6f;

// Some tens of float rounding errors at a parent, metres.
float offsetAt(const Patches& patches, uint32_t parent) {
    return kRelativeOffset * patches.islands[patches.parents[parent].island].reach;
}

[[noreturn]] void fail(RTCError code, const char* what) {
    // A tree that is built in several threads knows of an allocation that failed in one of them
    // only that it was cancelled, which is RTC_ERROR_UNKNOWN; nothing else can fail in it.
    const bool isMemory = code == RTC_ERROR_OUT_OF_MEMORY || code == RTC_ERROR_UNKNOWN;
    throw Error(
        isMemory                            ? RB_ERROR_OUT_OF_MEMORY
        : code == RTC_ERROR_UNSUPPORTED_CPU ? RB_ERROR_UNSUPPORTED_HARDWARE
                                            : RB_ERROR_UNKNOWN,
        std::string("the ray tracer failed: ") + (isMemory ? "out of memory, " : "") + what);
}

}  // namespace

struct Visibility::Embree {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    std::vector<uint32_t> parentOf;

    ~Embree() {
        if (scene) embree3.releaseScene(scene);
        if (device) embree3.releaseDevice(device);
    }
};

Visibility::Visibility(const Patches& patches, Blockers blockers)
    : patches(patches),
      surfaceOffset(kRelativeOffset * patches.radius),
      embree(std::make_unique<Embree>()) {
    embree->device = newEmbreeDevice();
    if (!embree->device) fail(embree3.getDeviceError(nullptr), "no device");
    embree->scene = embree3.newScene(embree->device);
    if (!embree->scene) fail(embree3.getDeviceError(embree->device), "no scene");
    // Robust: rays must not slip between neighbouring triangles.
    embree3.setSceneFlags(embree->scene,
                          RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);

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
        if (!geometry) fail(embree3.getDeviceError(embree->device), "no geometry");
        float* vertices = static_cast<float*>(
            embree3.setNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                         3 * sizeof(float), patches.vertices.size()));
        uint32_t* indices = static_cast<uint32_t*>(embree3.setNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(uint32_t), quads));
        if (!vertices || !indices) fail(embree3.getDeviceError(embree->device), "no buffers");
        std::memcpy(vertices, patches.vertices.data(), patches.vertices.size() * sizeof(glm::vec3));
        for (const Parent& parent : patches.parents) {
            if (!blocks(parent)) continue;
            // A triangle is a quad with its last corner twice.
            for (int k = 0; k < 4; ++k)
                *indices++ = parent.vertex[parent.isTriangle && k == 3 ? 2 : k];
        }
        embree3.commitGeometry(geometry);
        embree3.attachGeometry(embree->scene, geometry);
    }
    embree3.commitScene(embree->scene);
    const RTCError error = embree3.getDeviceError(embree->device);
    if (error != RTC_ERROR_NONE) fail(error, "building its tree");
}

Visibility::~Visibility() = default;

namespace {

// A list that filters write to. Embree swallows their exceptions: that there is no memory left is
// kept until the ray is done.
struct ParentList {
    std::vector<uint32_t> all;
    bool isIncomplete = false;

    bool has(uint32_t parent) const {
        return std::find(all.begin(), all.end(), parent) != all.end();
    }
    void add(uint32_t parent) {
        try {
            all.push_back(parent);
        } catch (const std::bad_alloc&) {
            isIncomplete = true;
        }
    }
    void check() const {
        if (isIncomplete) throw std::bad_alloc();
    }
};

// How a ray passes what lets light through: in part, or by chance.
struct Passage {
    const Patches* patches;
    const uint32_t* parentOf;
    std::optional<uint64_t> line;  // its name, where it passes by chance
    float share = 1;               // that has come through, where it passes in part
    // Parents that have taken their part: a ray along the diagonal of a quad meets both of its
    // triangles, and Embree may offer a hit twice.
    ParentList passed;

    // Whether the ray goes on through a parent that it meets at a point.
    bool goesOn(uint32_t parent, const glm::vec3& point) {
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
};

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

// What a ray meets first. Of surfaces that coincide there it is the one that comesBefore the
// others; so a ray that has met one goes on a little, through all that may coincide with it.
struct Nearest {
    struct Other {
        uint32_t parent;
        float distance;  // metres along the ray
    };
    uint32_t parent = kNoParent;
    float distance = 0;  // metres along the ray
    float zone = 0;      // what it meets less than this behind may coincide, metres
    // What it has met about as far away; of more than that, those that it met first. Without memory
    // of its own: Embree would swallow the exception if there were none left.
    std::array<Other, 16> others;
    size_t count = 0;

    // Notes what the ray meets; returns how far it goes on, metres.
    float meet(uint32_t other, float at, float otherZone) {
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
    void keep(const Other& other) {
        if (count == others.size()) {
            // What was about as far away as one that was nearer meanwhile.
            const auto isFar = [&](const Other& o) { return o.distance > distance + zone; };
            count = size_t(std::remove_if(others.begin(), others.end(), isFar) - others.begin());
        }
        if (count < others.size()) others[count++] = other;
    }

    // Of the nearest one and those that coincide with it, the first.
    uint32_t first(const Patches& patches, const glm::vec3& direction) const {
        uint32_t result = parent;
        auto enters = [&](uint32_t k) {
            return glm::dot(patches.parents[k].normal, direction) < 0;
        };
        for (size_t k = 0; k < count; ++k) {
            const auto& [other, at] = others[k];
            if (other != result && at <= distance + zone &&
                areParallel(patches.parents[result], patches.parents[other]) &&
                comesBefore(patches, other, enters(other), result, enters(result)))
                result = other;
        }
        return result;
    }
};

// What the filters need to know of a ray; starts with Embree's own part.
struct Query {
    RTCIntersectContext context;
    Passage passage;
    Nearest nearest;

    explicit Query(const Patches& patches, const uint32_t* parentOf) {
        rtcInitIntersectContext(&context);
        passage.patches = &patches;
        passage.parentOf = parentOf;
    }
    // Of a ray that is to find the first surface and meets one.
    void meet(const RTCFilterFunctionNArguments* args, uint32_t parent, const Hit& hit) {
        const float cosine =
            std::abs(glm::dot(passage.patches->parents[parent].normal, hit.direction));
        RTCRayN_tfar(args->ray, args->N, 0) = nearest.meet(
            parent, hit.distance, 2 * offsetAt(*passage.patches, parent) / std::max(0.01f, cosine));
    }
};

struct Start : Query {
    using Query::Query;
    uint32_t parent;
    bool isFront;      // the ray leaves the front of the parent
    glm::vec3 normal;  // of the side
    float zone;        // height over the side within which a hit coincides with it, metres
    // Of each ray, by its id in the packet: how far behind the surface it starts, metres along it,
    // and the parent that it ends on. A parent whose corners lie in a plane but for a rounding
    // error may stand before a point of its plane.
    std::array<float, Visibility::kPacket> behind;
    std::array<uint32_t, Visibility::kPacket> target;
};

// Lets a ray pass the surface that it starts on, what coincides with it on its other side, and what
// it meets behind: the next face of a box whose edge is near.
bool passesStart(const Start& start, uint32_t other, const glm::vec3& direction, float distance,
                 float behind) {
    if (other == start.parent) return true;
    const float height = distance * glm::dot(direction, start.normal);
    if (height > start.zone) return false;
    const Patches& patches = *start.passage.patches;
    const Parent& a = patches.parents[start.parent];
    const Parent& b = patches.parents[other];
    if (distance < behind && !areParallel(a, b)) return true;
    const float turn = glm::dot(glm::cross(b.a, b.b), direction);
    // Faces of one object that the ray crosses the same way lie beside its start; of others, those
    // that coincide with it may lie behind it.
    const bool alike = a.instance == b.instance && (turn > 0) == start.isFront;
    return alike || (areParallel(a, b) &&
                     !comesBefore(patches, start.parent, !start.isFront, other, turn < 0));
}

// Whether a ray goes on through a parent that it hits; id: of the ray in its packet.
bool goesOn(Start& start, uint32_t id, uint32_t other, const Hit& hit) {
    return other == start.target[id] ||
           passesStart(start, other, hit.direction, hit.distance, start.behind[id]) ||
           start.passage.goesOn(other, hit.point);
}

// Of rays that are blocked or not.
void passStart(const RTCFilterFunctionNArguments* args) {
    Start& start = *reinterpret_cast<Start*>(args->context);
    for (uint32_t k = 0; k < args->N; ++k) {
        if (args->valid[k] == 0) continue;
        const uint32_t other = start.passage.parentOf[RTCHitN_primID(args->hit, args->N, k)];
        if (goesOn(start, RTCRayN_id(args->ray, args->N, k), other, Hit(args, k)))
            args->valid[k] = 0;
    }
}

// Of a ray that is to find the first surface.
void meetAfterStart(const RTCFilterFunctionNArguments* args) {
    Start& start = *reinterpret_cast<Start*>(args->context);
    const uint32_t other = start.passage.parentOf[RTCHitN_primID(args->hit, args->N, 0)];
    const Hit hit(args);
    if (goesOn(start, 0, other, hit))
        args->valid[0] = 0;
    else
        start.meet(args, other, hit);
}

// Embree's assertions end the process for rays from or to where squares leave the range of floats.
// Such a ray, of points that are no numbers too, meets nothing and is blocked.
bool isValid(const glm::vec3& v) {
    constexpr float kMost = 1e18f;
    return std::abs(v.x) < kMost && std::abs(v.y) < kMost && std::abs(v.z) < kMost;
}

void setRay(RTCRay& ray, glm::vec3 origin, glm::vec3 direction, float distance) {
    if (!isValid(origin) || !isValid(direction)) {
        origin = glm::vec3(0.0f);
        direction = glm::vec3(0, 0, 1);
        distance = -1;
    }
    ray.org_x = origin.x;
    ray.org_y = origin.y;
    ray.org_z = origin.z;
    ray.dir_x = direction.x;
    ray.dir_y = direction.y;
    ray.dir_z = direction.z;
    ray.tnear = 0;
    ray.tfar = distance;
    ray.mask = ~0u;
    ray.id = 0;
}

// Of a ray that starts on no surface.
void meet(const RTCFilterFunctionNArguments* args) {
    Query& query = *reinterpret_cast<Query*>(args->context);
    const uint32_t parent = query.passage.parentOf[RTCHitN_primID(args->hit, args->N, 0)];
    const Hit hit(args);
    if (query.passage.goesOn(parent, hit.point))
        args->valid[0] = 0;
    else
        query.meet(args, parent, hit);
}

}  // namespace

struct Visibility::FromSide : Start {
    FromSide(const Visibility& visibility, uint32_t side)
        : Start(visibility.patches, visibility.embree->parentOf.data()) {
        context.filter = passStart;
        const Patches& patches = visibility.patches;
        parent = patches.parentOf[side / 2];
        isFront = side % 2 == 0;
        normal = patches.normal(side);
        zone = 2 * offsetAt(patches, parent);
        target.fill(kNoParent);
    }
    // Rays start this much behind the surface, so that they meet what coincides with it.
    // Behind along the ray and not along the normal: the ray still passes through the point.
    glm::vec3 origin(const glm::vec3& point, const glm::vec3& direction, size_t id = 0) {
        behind[id] = 0.5f * zone / std::max(0.01f, glm::dot(direction, normal));
        return point - behind[id] * direction;
    }
    // Sets a shadow ray; false if it is so short that nothing is between.
    bool setShadowRay(RTCRay& ray, const ShadowRay& shadow, size_t id = 0) {
        const glm::vec3 from = origin(shadow.point, shadow.direction, id);
        if (std::isfinite(shadow.distance)) {
            // Aim at the far end from the shifted origin, or the ray would pass beside it.
            const glm::vec3 segment = shadow.point + shadow.distance * shadow.direction - from;
            const float length = glm::length(segment);
            // The far end is rounded by how far it is.
            const float end = std::max(zone, kRelativeOffset * length);
            if (length <= end) return false;
            setRay(ray, from, segment / length, length - end);
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
    // What a ray has passed is noted for one ray alone.
    if (!patches.opacity.empty() || count == 1) {
        for (int k = 0; k < count; ++k) shares[k] = visibleShare(side, rays[k]);
        return;
    }
    FromSide start(*this, side);
    start.context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    // Embree without kernels for eight rays, on a processor without AVX, looks at all of them:
    // those that are not there end before they start.
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

// The side of a parent, at a point on it, that a direction looks at.
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
    const Nearest& nearest = start.nearest;
    if (nearest.parent == kNoParent) return std::nullopt;
    if (distance) *distance = std::max(0.0f, nearest.distance - glm::length(point - origin));
    // What coincides with the start has its order already.
    const bool isAtStart = nearest.distance * glm::dot(direction, start.normal) <= 2 * start.zone;
    return sideOf(isAtStart ? nearest.parent : nearest.first(patches, direction),
                  origin + nearest.distance * direction, direction);
}

std::optional<uint32_t> Visibility::firstHit(const glm::vec3& origin, const glm::vec3& direction,
                                             float* distance) const {
    Query from(patches, embree->parentOf.data());
    from.context.filter = meet;
    if (!patches.opacity.empty()) from.passage.line = lineName(origin, direction);
    RTCRayHit query{};
    setRay(query.ray, origin, direction, std::numeric_limits<float>::infinity());
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    embree3.intersect1(embree->scene, &from.context, &query);
    const Nearest& nearest = from.nearest;
    if (nearest.parent == kNoParent) return std::nullopt;
    if (distance) *distance = nearest.distance;
    return sideOf(nearest.first(patches, direction), origin + nearest.distance * direction,
                  direction);
}

namespace {

// Collects the parents that a line crosses; starts with Embree's own part.
struct Crossed {
    RTCIntersectContext context;
    const uint32_t* parentOf;
    ParentList parents;
};

// Notes a hit and lets the ray go on. A parent is plane and crossed once: a line along the diagonal
// of a quad meets both of its triangles, and Embree may offer a hit twice.
void collect(const RTCFilterFunctionNArguments* args) {
    Crossed& crossed = *reinterpret_cast<Crossed*>(args->context);
    const uint32_t parent = crossed.parentOf[RTCHitN_primID(args->hit, args->N, 0)];
    if (!crossed.parents.has(parent)) crossed.parents.add(parent);
    args->valid[0] = 0;
}

bool haveCommonVertex(const Parent& a, const Parent& b) {
    for (int i = 0; i < (a.isTriangle ? 3 : 4); ++i)
        for (int j = 0; j < (b.isTriangle ? 3 : 4); ++j)
            if (a.vertex[size_t(i)] == b.vertex[size_t(j)]) return true;
    return false;
}

}  // namespace

void Visibility::lineHits(const glm::dvec3& point, const glm::dvec3& direction,
                          std::vector<LineHit>& hits) const {
    Crossed crossed;
    rtcInitIntersectContext(&crossed.context);
    crossed.context.filter = collect;
    crossed.parentOf = embree->parentOf.data();
    RTCRayHit query{};
    setRay(query.ray, glm::vec3(point - 2.5 * double(patches.radius) * direction),
           glm::vec3(direction), std::numeric_limits<float>::infinity());
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    embree3.intersect1(embree->scene, &crossed.context, &query);

    hits.clear();
    const uint64_t name = lineName(glm::vec3(point), glm::vec3(direction));
    crossed.parents.check();
    for (uint32_t index : crossed.parents.all) {
        // In double and from the plane of the parent, as the rasteriser does: surfaces that
        // coincide then have the same depth.
        const Parent& parent = patches.parents[index];
        const glm::dvec3 normal = glm::cross(glm::dvec3(parent.a), glm::dvec3(parent.b));
        const double slant = glm::dot(normal, direction);
        if (slant == 0) continue;
        double low = std::numeric_limits<double>::max(), high = -low;
        for (int k = 0; k < (parent.isTriangle ? 3 : 4); ++k) {
            const double z =
                glm::dot(glm::dvec3(patches.vertices[parent.vertex[size_t(k)]]) - point, direction);
            low = std::min(low, z);
            high = std::max(high, z);
        }
        const double depth =
            std::clamp(glm::dot(normal, glm::dvec3(parent.origin) - point) / slant, low, high);
        const uint32_t patch = patches.patchAt(index, glm::vec3(point + depth * direction));
        if (!patches.opacity.empty() && !stops(patches, patch, name)) continue;
        hits.push_back({depth, 2 * patch + (slant < 0 ? 0 : 1)});
    }
    std::sort(hits.begin(), hits.end(), [](const LineHit& a, const LineHit& b) {
        return a.depth != b.depth ? a.depth < b.depth : a.side < b.side;
    });
    auto isSameCrossing = [&](const LineHit& a, const LineHit& b) {
        return b.depth - a.depth <= 2 * double(offsetAt(patches, patches.parentOf[a.side / 2])) &&
               a.side % 2 == b.side % 2 &&
               haveCommonVertex(patches.parents[patches.parentOf[a.side / 2]],
                                patches.parents[patches.parentOf[b.side / 2]]);
    };
    hits.erase(std::unique(hits.begin(), hits.end(), isSameCrossing), hits.end());
}

}  // namespace raybundle
