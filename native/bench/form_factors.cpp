// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/form_factors.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "bundles/bundle_tracer.h"
#include "sampling/sphere_sampling.h"
#include "visibility/local_lines.h"

namespace raybundle {
namespace {

// Calls visit(s, t) for each gap along a line that starts outside the scene: s and t are the sides
// that face each other across the gap, or kNone for the outside.
constexpr uint32_t kNone = UINT32_MAX;
template <class Visit>
void walkLine(const FormFactor& f, glm::vec3 point, const glm::vec3& direction,
              const Visit& visit) {
    std::vector<uint32_t> passed;  // parents met so far; at an edge a ray may turn back
    float distance = 0;
    uint32_t before = kNone;
    auto met = f.visibility.firstHit(point, direction, &distance);
    while (met) {
        const uint32_t parent = f.patches.parentOf[*met / 2];
        if (std::find(passed.begin(), passed.end(), parent) != passed.end()) break;
        passed.push_back(parent);
        visit(before, *met);
        point += distance * direction;
        before = *met ^ 1;
        met = f.visibility.firstHit(before, point, direction, &distance);
    }
    visit(before, kNone);
}

}  // namespace

double formFactorByArea(const FormFactor& f, uint32_t lines, std::mt19937_64& random) {
    const glm::vec3 normal = f.patches.normal(f.from), otherNormal = f.patches.normal(f.to);
    double sum = 0;
    for (uint32_t k = 0; k < lines; ++k) {
        const glm::vec4 u = uniformPoint(random);
        const glm::vec3 x = f.patches.point(f.from / 2, {u.x, u.y});
        const glm::vec3 between = f.patches.point(f.to / 2, {u.z, u.w}) - x;
        const float distance = glm::length(between);
        const glm::vec3 direction = between / distance;
        const float cosine = glm::dot(normal, direction), other = -glm::dot(otherNormal, direction);
        if (cosine <= 0 || other <= 0) continue;
        if (f.visibility.isBlocked(f.from, x, direction, distance)) continue;
        sum += double(cosine) * double(other) / (double(distance) * double(distance));
    }
    return double(f.patches.area[f.to / 2]) / glm::pi<double>() * sum / lines;
}

double formFactorByHemisphere(const FormFactor& f, uint32_t lines, std::mt19937_64& random) {
    const glm::vec3 normal = f.patches.normal(f.from);
    const auto [right, up] = frame(normal);
    double sum = 0;
    for (uint32_t k = 0; k < lines; ++k) {
        const glm::vec4 u = uniformPoint(random);
        const float theta = glm::half_pi<float>() * u.z, psi = glm::two_pi<float>() * u.w;
        const float sine = std::sin(theta), cosine = std::cos(theta);
        const glm::vec3 direction =
            sine * (std::cos(psi) * right + std::sin(psi) * up) + cosine * normal;
        const auto met =
            f.visibility.firstHit(f.from, f.patches.point(f.from / 2, {u.x, u.y}), direction);
        if (met == f.to) sum += double(cosine) * double(sine);
    }
    return glm::pi<double>() * sum / lines;
}

double formFactorByCosine(const FormFactor& f, uint32_t lines, std::mt19937_64& random) {
    const glm::vec3 normal = f.patches.normal(f.from);
    uint32_t hits = 0;
    for (uint32_t k = 0; k < lines; ++k) {
        const glm::vec4 u = uniformPoint(random);
        hits += f.visibility.firstHit(f.from, f.patches.point(f.from / 2, {u.x, u.y}),
                                      cosineDirection(normal, {u.z, u.w})) == f.to;
    }
    return double(hits) / lines;
}

double formFactorByGlobalLines(const FormFactor& f, uint32_t lines, std::mt19937_64& random) {
    const float radius = 1.001f * f.patches.radius;
    uint64_t leaving = 0, between = 0;
    for (uint32_t k = 0; k < lines; ++k) {
        const glm::vec4 u = uniformPoint(random);
        const glm::vec3 a = radius * uniformDirection({u.x, u.y});
        const glm::vec3 b = radius * uniformDirection({u.z, u.w});
        if (a == b) continue;
        walkLine(f, a, glm::normalize(b - a), [&](uint32_t s, uint32_t t) {
            leaving += s == f.from || t == f.from;
            between += (s == f.from && t == f.to) || (s == f.to && t == f.from);
        });
    }
    return leaving > 0 ? double(between) / double(leaving) : 0;
}

double formFactorByBundles(const FormFactor& f, uint32_t lines, uint32_t bundles,
                           std::mt19937_64& random) {
    const double perBundle = double(lines) / bundles;
    const float pixelSize = f.patches.radius * float(std::sqrt(glm::pi<double>() / perBundle));
    BundleTracer tracer(ProjectorKind::FRAGMENT_LISTS, {f.patches, f.visibility, pixelSize},
                        DirectionKind::RANDOM, uint32_t(random()));
    uint64_t leaving = 0, between = 0;
    for (const TracedBundle& traced : tracer.trace(bundles)) {
        for (const Exchange& e : traced.lines.exchanges) {
            if (e.i != f.from && e.j != f.from) continue;
            leaving += e.lines;
            if (e.i == f.to || e.j == f.to) between += e.lines;
        }
        leaving += uint64_t(std::count(traced.lines.sky.begin(), traced.lines.sky.end(), f.from));
    }
    return leaving > 0 ? double(between) / double(leaving) : 0;
}

const std::vector<FormFactorEstimator>& formFactorEstimators() {
    static const std::vector<FormFactorEstimator> all = {
        {"area", formFactorByArea},
        {"hemisphere", formFactorByHemisphere},
        {"cosine", formFactorByCosine},
        {"global lines", formFactorByGlobalLines},
        {"bundles",
         [](const FormFactor& f, uint32_t lines, std::mt19937_64& random) {
             return formFactorByBundles(f, lines, std::max(2u, lines / 100 & ~1u), random);
         }},
    };
    return all;
}

}  // namespace raybundle
