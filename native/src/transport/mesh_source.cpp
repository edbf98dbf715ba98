// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/mesh_source.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <map>

#include "transport/sphere_sampling.h"

namespace raybundle {
namespace {

// A source of more parents than this, or whose outline has more edges, has no closed form: sampling
// it is quicker.
constexpr size_t kMaxPolygons = 16, kMaxEdges = 4 * kMaxPolygons;
// Edges that follow each other and turn by less are one, radians.
constexpr double kStraight = 1e-5;

// An edge's part of Lambert's sum: the angle it spans times the cosine of its normal; a and b are
// relative to the receiver.
double edgeTerm(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& normal) {
    const glm::dvec3 c = glm::cross(a, b);
    const double length = glm::length(c);
    if (length <= 0) return 0;
    // In float the angle keeps its relative precision, which is all that the sum needs.
    return double(std::atan2(float(length), float(glm::dot(a, b)))) * glm::dot(c, normal) / length;
}

float strength(const glm::vec3& emission) { return emission.x + emission.y + emission.z; }

}  // namespace

double polygonIrradiance(const glm::dvec3& point, const glm::dvec3& normal,
                         const glm::dvec3* polygon, int count) {
    // Clip at the horizon of the receiver.
    std::array<glm::dvec3, 8> clipped;
    int n = 0;
    for (int k = 0; k < count; ++k) {
        const glm::dvec3 a = polygon[k] - point, b = polygon[(k + 1) % count] - point;
        const double ha = glm::dot(a, normal), hb = glm::dot(b, normal);
        if (ha > 0) clipped[n++] = a;
        if ((ha > 0) != (hb > 0)) clipped[n++] = a + (ha / (ha - hb)) * (b - a);
    }
    double sum = 0;
    for (int k = 0; k < n; ++k) {
        const glm::dvec3 a = clipped[k], b = clipped[(k + 1) % n];
        sum += edgeTerm(a, b, normal);
    }
    return 0.5 * std::abs(sum);
}

MeshSource::MeshSource(const Patches& patches, std::vector<uint32_t> parents,
                       const std::array<glm::vec3, 2>& emission,
                       const std::vector<glm::vec3>* sideEmission)
    : patches(patches),
      parents(std::move(parents)),
      emission(emission),
      sideEmission(sideEmission) {
    for (uint32_t parent : this->parents) {
        total += patches.parents[parent].area();
        areaUpTo.push_back(total);
    }
    totalPower = float(total) * (emission[0] + emission[1]);
    if (sideEmission) chooseByPower();
    boundSource();
}

void MeshSource::chooseByPower() {
    double sum = 0;
    totalPower = glm::vec3(0.0f);
    for (uint32_t index : parents) {
        const Parent& parent = patches.parents[index];
        for (uint32_t p = parent.firstPatch; p < parent.firstPatch + parent.patchCount(); ++p) {
            const float area = parent.areaOf(p - parent.firstPatch);
            for (int k = 0; k < 2; ++k) {
                const glm::vec3 power = area * emissionOf(p, k);
                if (!(strength(power) > 0)) continue;
                totalPower += power;
                shining.push_back(2 * p + uint32_t(k));
                powerUpTo.push_back(sum += double(strength(power)));
            }
        }
    }
}

// Of the front (k = 0) or the back of a patch, W/m^2.
glm::vec3 MeshSource::emissionOf(uint32_t patch, int k) const {
    return sideEmission ? (*sideEmission)[2 * patch + uint32_t(k)] : emission[size_t(k)];
}

glm::vec3 MeshSource::emissionAt(const SurfacePoint& on, int k) const {
    return on.side ? emissionOf(*on.side / 2, k) : emission[size_t(k)];
}

LightSample MeshSource::sample(const glm::vec3& point, const glm::vec3& receiver,
                               glm::vec2 uv) const {
    const SurfacePoint on = onSurface(uv);
    const bool front = glm::dot(point - on.position, on.normal) > 0;
    return surfaceSample(point, receiver, on.position, front ? on.normal : -on.normal,
                         emissionAt(on, front ? 0 : 1) / glm::pi<float>(), on.area);
}

std::optional<glm::vec3> MeshSource::irradiance(const glm::vec3& point,
                                                const glm::vec3& receiver) const {
    if (sideEmission) return std::nullopt;
    if (!outline.empty()) return outlineIrradiance(point, receiver);
    if (parents.size() > kMaxPolygons) return std::nullopt;
    glm::vec3 sum(0.0f);
    for (uint32_t index : parents) {
        const Parent& parent = patches.parents[index];
        const bool front = glm::dot(point - parent.origin, parent.normal) > 0;
        const glm::vec3 radiance = emission[front ? 0 : 1] / glm::pi<float>();
        if (radiance == glm::vec3(0.0f)) continue;
        const int count = parent.isTriangle ? 3 : 4;
        glm::dvec3 corners[4];
        for (int k = 0; k < count; ++k) corners[k] = patches.vertices[parent.vertex[k]];
        sum += radiance * float(polygonIrradiance(point, receiver, corners, count));
    }
    return sum;
}

bool MeshSource::isOutOfSight(const glm::vec3& point, const glm::vec3& receiver,
                              float radius) const {
    if (glm::dot(receiver, centre - point) < -(radius + extent)) return true;
    return isPlanar &&
           emission[glm::dot(point - centre, planeNormal) > 0 ? 0 : 1] == glm::vec3(0.0f) &&
           std::abs(glm::dot(point - centre, planeNormal)) > radius;
}

EmittedRay MeshSource::emit(const glm::vec4& r, float) const {
    // Choose the side by its share of the power.
    SurfacePoint on{};
    bool front;
    if (sideEmission) {
        on = onSurface({r.x, r.y});
        front = *on.side % 2 == 0;
    } else {
        const float share0 =
            strength(emission[0]) / (strength(emission[0]) + strength(emission[1]));
        front = r.x < share0;
        const float u = front ? r.x / share0 : (r.x - share0) / (1 - share0);
        on = onSurface({std::min(u, 0.9999999f), r.y});
    }
    EmittedRay ray;
    // The side is chosen by the sum of the channels.
    const glm::vec3 own = emissionAt(on, front ? 0 : 1);
    for (int c = 0; c < 3; ++c)
        if (totalPower[c] > 0)
            ray.weight[c] = own[c] / strength(own) * (strength(totalPower) / totalPower[c]);
    ray.origin = on.position;
    ray.normal = front ? on.normal : -on.normal;
    ray.direction = cosineDirection(ray.normal, {r.z, r.w});
    const uint32_t patch = on.side ? *on.side / 2 : patches.patchAt(on.parent, on.position);
    ray.side = 2 * patch + (front ? 0 : 1);
    return ray;
}

// The closed form of a planar source: the edges inside it cancel, so its outline is enough. Where the
// receiver's horizon cuts the outline, the cut closes it: along the line in which the two planes
// meet, from where edges go down to where they come up, whichever belong together.
glm::vec3 MeshSource::outlineIrradiance(const glm::vec3& point, const glm::vec3& receiver) const {
    const glm::dvec3 p(point), n(receiver);
    const double distance = glm::dot(glm::dvec3(centre) - p, glm::dvec3(planeNormal));
    const glm::vec3& emitted = emission[distance < 0 ? 0 : 1];
    if (emitted == glm::vec3(0.0f)) return glm::vec3(0.0f);
    // Towards the line, along the horizon; and the angle there of a point on it.
    const glm::dvec3 ahead = distance *
                             (glm::dvec3(planeNormal) - glm::dot(glm::dvec3(planeNormal), n) * n),
                     aside = glm::cross(n, ahead);
    auto angle = [&](const glm::dvec3& q) {
        return double(std::atan2(float(glm::dot(q, aside)), float(glm::dot(q, ahead))));
    };
    double sum = 0;
    for (const auto& [from, to] : outline) {
        const glm::dvec3 a = from - p, b = to - p;
        const double ha = glm::dot(a, n), hb = glm::dot(b, n);
        if (ha <= 0 && hb <= 0) continue;
        if (ha > 0 && hb > 0) {
            sum += edgeTerm(a, b, n);
            continue;
        }
        const glm::dvec3 cut = a + (ha / (ha - hb)) * (b - a);
        sum += ha > 0 ? edgeTerm(a, cut, n) - angle(cut) : edgeTerm(cut, b, n) + angle(cut);
    }
    return emitted / glm::pi<float>() * float(0.5 * std::abs(sum));
}

void MeshSource::findOutline() {
    // How often an edge is passed from the lower to the higher vertex, less the other way round.
    std::map<std::pair<uint32_t, uint32_t>, int> edges;
    for (uint32_t index : parents) {
        const Parent& parent = patches.parents[index];
        const int n = parent.isTriangle ? 3 : 4;
        for (int k = 0; k < n; ++k) {
            const uint32_t a = parent.vertex[size_t(k)], b = parent.vertex[size_t((k + 1) % n)];
            edges[std::minmax(a, b)] += a < b ? 1 : -1;
        }
    }
    struct Meeting {
        uint32_t neighbour;
        int count;
    };
    std::map<uint32_t, Meeting> before, after;  // per vertex, of the edges that arrive and leave
    auto meet = [](std::map<uint32_t, Meeting>& at, uint32_t vertex, uint32_t neighbour) {
        ++at.try_emplace(vertex, Meeting{neighbour, 0}).first->second.count;
    };
    std::vector<std::pair<uint32_t, uint32_t>> directed;
    for (const auto& [edge, count] : edges)
        for (int k = 0; k < std::abs(count); ++k) {
            const auto [from, to] = count > 0 ? edge : std::pair(edge.second, edge.first);
            directed.emplace_back(from, to);
            meet(after, from, to);
            meet(before, to, from);
        }
    auto at = [&](uint32_t vertex) { return glm::dvec3(patches.vertices[vertex]); };
    auto isStraight = [&](uint32_t vertex) {
        const Meeting &in = before.at(vertex), &out = after.at(vertex);
        if (in.count > 1 || out.count > 1) return false;
        const glm::dvec3 u = at(vertex) - at(in.neighbour), v = at(out.neighbour) - at(vertex);
        return glm::dot(u, v) > 0 &&
               glm::length(glm::cross(u, v)) <= kStraight * glm::length(u) * glm::length(v);
    };
    size_t used = 0;
    for (const auto& [from, first] : directed) {
        if (isStraight(from)) continue;
        uint32_t to = first;
        for (++used; isStraight(to); ++used) to = after.at(to).neighbour;
        outline.emplace_back(at(from), at(to));
    }
    // A loop without a corner is a circle of very many edges.
    if (outline.size() > kMaxEdges || used < directed.size()) outline.clear();
}

// Sphere around the source, and whether it lies in one plane with one front.
void MeshSource::boundSource() {
    glm::vec3 low(INFINITY), high(-INFINITY);
    auto forEachVertex = [&](const auto& body) {
        for (uint32_t index : parents) {
            const Parent& parent = patches.parents[index];
            for (int k = 0; k < (parent.isTriangle ? 3 : 4); ++k)
                body(patches.vertices[parent.vertex[k]]);
        }
    };
    forEachVertex([&](const glm::vec3& v) {
        low = glm::min(low, v);
        high = glm::max(high, v);
    });
    centre = 0.5f * (low + high);
    extent = 0.5f * glm::length(high - low);
    const Parent& first = patches.parents[parents.front()];
    planeNormal = first.normal;
    isPlanar = true;
    forEachVertex([&](const glm::vec3& v) {
        isPlanar = isPlanar && std::abs(glm::dot(v - centre, planeNormal)) <= 1e-5f * extent;
    });
    for (uint32_t index : parents) {
        const Parent& parent = patches.parents[index];
        isPlanar = isPlanar && glm::dot(parent.normal, planeNormal) > 0;
    }
    if (isPlanar && !sideEmission) findOutline();
}

// A point, uniform by area or chosen by power, and the front's normal there.
MeshSource::SurfacePoint MeshSource::onSurface(glm::vec2 uv) const {
    if (!sideEmission) return onParents(uv);
    if (shining.empty()) return {{}, {}, parents.front(), 0, 0};
    const double at = double(uv.x) * powerUpTo.back();
    const size_t k = std::min<size_t>(
        size_t(std::upper_bound(powerUpTo.begin(), powerUpTo.end(), at) - powerUpTo.begin()),
        shining.size() - 1);
    const double before = k ? powerUpTo[k - 1] : 0, own = powerUpTo[k] - before;
    const uint32_t patch = shining[k] / 2;
    const Parent& parent = patches.parents[patches.parentOf[patch]];
    const glm::vec2 within(float(std::clamp((at - before) / own, 0.0, 1.0)), uv.y);
    const float area = parent.areaOf(patch - parent.firstPatch);
    // The patch may be chosen for either side.
    const float share = strength(emissionOf(patch, 0) + emissionOf(patch, 1)) * area;
    return {patches.point(patch, within), parent.normal, patches.parentOf[patch], shining[k],
            float(double(area) * powerUpTo.back() / double(share))};
}

MeshSource::SurfacePoint MeshSource::onParents(glm::vec2 uv) const {
    const double at = uv.x * total;
    const size_t k = std::min<size_t>(
        size_t(std::upper_bound(areaUpTo.begin(), areaUpTo.end(), at) - areaUpTo.begin()),
        parents.size() - 1);
    const double before = k ? areaUpTo[k - 1] : 0;
    const Parent& parent = patches.parents[parents[k]];
    float s = float(std::clamp((at - before) / (areaUpTo[k] - before), 0.0, 1.0)), t = uv.y;
    if (parent.isTriangle && s + t > 1) {
        s = 1 - s;
        t = 1 - t;
    }
    return {parent.position({s, t}), parent.normal, parents[k], std::nullopt, float(total)};
}

}  // namespace raybundle
