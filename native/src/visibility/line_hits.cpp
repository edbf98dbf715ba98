// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <limits>

#include "patches/opacity.h"
#include "patches/side.h"
#include "visibility/ray_query.h"
#include "visibility/visibility.h"

namespace raybundle {
namespace {

// Collects the parents that a line crosses. It begins with Embree's context.
struct Crossed {
    RTCIntersectContext context;
    const uint32_t* parentOf;
    MetParents parents;
};

// Records a hit and lets the ray continue. A parent is plane, so it is crossed once; but a line
// along the diagonal of a quad meets both of its triangles, and Embree may report a hit twice.
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
        // Depths are computed in double from the plane of the parent, as in the rasteriser, so that
        // surfaces that coincide have the same depth.
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
        return b.depth - a.depth <=
                   2 * double(offsetAt(patches, patches.parentOf[patchOf(a.side)])) &&
               isBack(a.side) == isBack(b.side) &&
               haveCommonVertex(patches.parentAt(a.side), patches.parentAt(b.side));
    };
    hits.erase(std::unique(hits.begin(), hits.end(), isSameCrossing), hits.end());
}

}  // namespace raybundle
