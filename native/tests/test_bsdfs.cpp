// SPDX-License-Identifier: GPL-3.0-or-later
#include "test_bsdfs.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "surfaces/microfibers.h"
#include "test_scenes.h"

namespace raybundle::test {
namespace {

// Returns Fresnel's reflectance for an index of refraction of 1.5, scaled to 0 at normal incidence
// and 1 at grazing incidence.
double fresnelEdge(double cosine) {
    const double g = std::sqrt(1.5 * 1.5 - 1 + cosine * cosine), a = (g - cosine) / (g + cosine);
    const double b = ((g + cosine) * cosine - 1) / ((g - cosine) * cosine + 1);
    return (a * a * (1 + b * b) / 2 - 0.04) / 0.96;
}

// Returns the albedo of white GGX towards a direction, by sampling facets from the distribution D.
double ggxAlbedo(double roughness, const glm::dvec3& out) {
    const double a2 = std::pow(roughness, 4);
    constexpr int kSteps = 400;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i)
        for (int j = 0; j < kSteps; ++j) {
            // The samples are uniform in the root of the share, because grazing views see the
            // facets that stand upright.
            const double root = (i + 0.5) / kSteps, u = 1 - root * root;
            const double phi = kPi * (j + 0.5) / kSteps;
            const double z = root / std::sqrt(1 + (a2 - 1) * u), r = std::sqrt(1 - z * z);
            const glm::dvec3 h(r * std::cos(phi), r * std::sin(phi), z);
            const double oh = glm::dot(out, h);
            const glm::dvec3 in = 2 * oh * h - out;
            if (oh <= 0 || in.z <= 0) continue;
            auto lambda = [&](double c) { return (std::sqrt(1 + a2 * (1 / (c * c) - 1)) - 1) / 2; };
            sum += 2 * root * oh / (out.z * z * (1 + lambda(in.z) + lambda(out.z)));
        }
    return sum / (kSteps * kSteps);
}

}  // namespace

Bsdf ggx(double roughness, double f0, rb_masking masking) {
    const double a2 = std::pow(roughness, 4);
    return [=](const glm::dvec3& in, const glm::dvec3& out) {
        const glm::dvec3 h = glm::normalize(in + out);
        auto lambda = [&](double z) { return (std::sqrt(1 + a2 * (1 - z * z) / (z * z)) - 1) / 2; };
        const double d = a2 / (kPi * std::pow(h.z * h.z * (a2 - 1) + 1, 2));
        const double g = masking == RB_MASKING_CORRELATED
                             ? 1 / (1 + lambda(in.z) + lambda(out.z))
                             : 1 / ((1 + lambda(in.z)) * (1 + lambda(out.z)));
        const double f = f0 + (1 - f0) * fresnelEdge(glm::dot(in, h));
        return d * f * g / (4 * in.z * out.z);
    };
}

Bsdf burley(double roughness) {
    return [=](const glm::dvec3& in, const glm::dvec3& out) {
        const double ih = glm::dot(in, glm::normalize(in + out));
        const double grazing = 0.5 + 2 * roughness * ih * ih;
        auto fresnel = [&](double z) { return 1 + (grazing - 1) * std::pow(1 - z, 5); };
        return fresnel(in.z) * fresnel(out.z) / kPi;
    };
}

Bsdf orenNayar(double sigma) {
    return [=](const glm::dvec3& in, const glm::dvec3& out) {
        const double s = glm::dot(in, out) - in.z * out.z;
        const double t = s > 0 ? std::max(in.z, out.z) : 1;
        return (1 + sigma * s / t) / (kPi + (kPi / 2 - 2.0 / 3) * sigma);
    };
}

Bsdf velvet(double sigma) {
    return [=](const glm::dvec3& in, const glm::dvec3& out) {
        const glm::dvec3 h = glm::normalize(in + out);
        const double rest = std::max(1 - h.z * h.z, 1e-12);
        const double d =
            std::exp(-h.z * h.z / (rest * sigma * sigma)) / (kPi * sigma * sigma * rest * rest);
        const double g = std::min(1.0, 2 * h.z * std::min(in.z, out.z) / glm::dot(in, h));
        return d * g / (4 * in.z * out.z);
    };
}

Bsdf burleySheen() {
    return [](const glm::dvec3& in, const glm::dvec3& out) {
        return std::pow(1 - glm::dot(in, glm::normalize(in + out)), 5);
    };
}

Bsdf transformedCosine(double roughness) {
    return [=](const glm::dvec3& in, const glm::dvec3& out) {
        const Microfibers fibers = Microfibers::at(float(roughness), float(out.z));
        const double a = double(fibers.a), b = double(fibers.b), sine = std::hypot(out.x, out.y);
        const glm::dvec3 x = sine > 0 ? glm::dvec3(out.x, out.y, 0) / sine : glm::dvec3(1, 0, 0);
        const double along = glm::dot(x, in),
                     across = glm::dot(glm::cross(glm::dvec3(0, 0, 1), x), in);
        const glm::dvec3 before(a * along + b * in.z, a * across, in.z);
        const double length = glm::length(before);
        return double(fibers.albedo) * before.z / length * a * a / std::pow(length, 3) /
               (kPi * in.z);
    };
}

void forCosine(int n, const std::function<void(const glm::dvec3&, double)>& visit) {
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const double z = (i + 0.5) / n, r = std::sqrt(1 - z * z), phi = 2 * kPi * (j + 0.5) / n;
            // The midpoint rule makes the sum of 2 z / n^2 exact.
            visit({r * std::cos(phi), r * std::sin(phi), z}, 2 * z / (n * n));
        }
}

glm::dvec2 moments(const Bsdf& bsdf, const glm::dvec3& in, int steps) {
    glm::dvec2 sum(0.0);
    forCosine(steps, [&](const glm::dvec3& out, double share) {
        const double value = kPi * bsdf(in, out);
        sum += share * glm::dvec2(value, value * value);
    });
    return sum;
}

glm::dvec3 inclined(double cosine) { return {std::sqrt(1 - cosine * cosine), 0, cosine}; }

Bsdf severalFacets(double roughness) {
    const Bsdf once = ggx(roughness, 1);
    constexpr int kSteps = 40;
    std::vector<double> lost;  // albedo lost, by the root of the cosine
    for (int i = 0; i <= kSteps; ++i)
        lost.push_back(
            1 / ggxAlbedo(roughness, inclined(std::max(std::pow(double(i) / kSteps, 2), 1e-4))) -
            1);
    return [=](const glm::dvec3& in, const glm::dvec3& out) {
        const double at = std::sqrt(std::min(out.z, 1.0)) * kSteps;
        const size_t low = std::min(size_t(at), size_t(kSteps - 1));
        return once(in, out) * glm::mix(lost[low], lost[low + 1], at - double(low));
    };
}

}  // namespace raybundle::test
