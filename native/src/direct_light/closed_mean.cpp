// SPDX-License-Identifier: GPL-3.0-or-later
//
// Mean of a closed form over a patch. If the source cannot compute this mean itself, Gauss
// quadrature does (degree 3 on a parallelogram, 2 on a triangle). The patch is divided into more
// parts if the closed form varies much over it: beside a source the irradiance falls from a finite
// value at the common edge with an infinite slope. Where the light ends within the patch, at the rim
// of a spot lamp, points in rows would all be on the same side of the rim. There samples of the
// source at the points of a Fibonacci lattice are used, no two of which are in one row or column.
#include "direct_light/closed_mean.h"

#include "patches/patches.h"
#include "scene/channels.h"

namespace raybundle {
namespace {

// If the ratio of the largest and the smallest value of the closed form on a patch exceeds this,
// more points are used.
constexpr float kSmooth = 1.1f;

// The mean and the extremes of the closed form at the points of a quadrature, W/m^2.
struct Quadrature {
    glm::vec3 mean{0.0f};
    glm::vec3 low{INFINITY}, high{0.0f};
};

// Evaluates the quadrature on the patch divided into parts * parts. Returns nothing if the source
// has no closed form.
std::optional<Quadrature> quadrature(const LightSource& source, const ReceiverPlace& place,
                                     int parts) {
    // Parent::pointOn finds the points of a regular grid, so the parts are described as the tiles
    // of a parent.
    Parent grid;
    grid.isTriangle = place.isTriangle;
    grid.countA = grid.countB = uint16_t(parts);
    static constexpr float kGauss = 0.21132487f;  // (1 - 1 / sqrt 3) / 2
    static const glm::vec2 kSquare[4] = {
        {kGauss, kGauss}, {1 - kGauss, kGauss}, {kGauss, 1 - kGauss}, {1 - kGauss, 1 - kGauss}};
    static const glm::vec2 kTriangle[3] = {
        {1.0f / 6, 1.0f / 6}, {2.0f / 3, 1.0f / 6}, {1.0f / 6, 2.0f / 3}};
    const int points = place.isTriangle ? 3 : 4;
    Quadrature result;
    glm::vec3 sum(0.0f);
    for (uint32_t part = 0; part < grid.patchCount(); ++part)
        for (int k = 0; k < points; ++k) {
            const glm::vec2 st = grid.pointOn(part, place.isTriangle ? kTriangle[k] : kSquare[k]);
            const auto value =
                source.irradiance(place.origin + st.x * place.a + st.y * place.b, place.normal);
            if (!value) return std::nullopt;
            sum += *value;
            result.low = glm::min(result.low, *value);
            result.high = glm::max(result.high, *value);
        }
    result.mean = sum / float(grid.patchCount() * points);
    return result;
}

// Returns the mean over the points of a Fibonacci lattice, or nothing if the source has no closed
// form. `count` and `step` are successive Fibonacci numbers.
std::optional<ClosedMean> latticeMean(const LightSource& source, const ReceiverPlace& place,
                                      uint32_t count, uint32_t step) {
    glm::vec3 sums[2] = {glm::vec3(0.0f), glm::vec3(0.0f)};
    for (uint32_t k = 0; k < count; ++k) {
        const glm::vec2 uv = (glm::vec2(k, k * step % count) + 0.5f) / float(count);
        const auto [point, weight] =
            source.choosesPlaces() ? source.placeOn(place, uv) : PatchPoint{place.at(uv)};
        const auto value = source.irradiance(point, place.normal);
        if (!value) return std::nullopt;
        sums[k % 2] += weight * *value;
    }
    const glm::vec3 even = sums[0] / float((count + 1) / 2), odd = sums[1] / float(count / 2);
    return ClosedMean{0.5f * (even + odd), brightest(glm::abs(even - odd)) / 2};
}

}  // namespace

std::optional<ClosedMean> closedMean(const LightSource& source, const ReceiverPlace& place,
                                     float tolerance) {
    auto exact = [](const std::optional<glm::vec3>& mean) {
        return mean ? std::optional(ClosedMean{*mean, 0}) : std::nullopt;
    };
    if (place.radius > 0 && source.isSteepOn(place)) {
        const auto mean = latticeMean(source, place, 233, 144);
        return !mean || mean->error <= tolerance ? mean : latticeMean(source, place, 987, 610);
    }
    if (place.radius == 0 || place.radius < source.farPatch() * source.distance(place.centroid()))
        return exact(source.irradiance(place.centroid(), place.normal));
    if (const auto mean = source.meanIrradiance(place)) return exact(mean);
    const auto coarse = quadrature(source, place, 1);
    if (!coarse) return std::nullopt;
    // By symmetry the points of the quadrature alone may have equal values.
    const auto middle = source.irradiance(place.centroid(), place.normal);
    if (brightest(glm::max(coarse->high, *middle)) <=
        kSmooth * brightest(glm::min(coarse->low, *middle)))
        return exact(coarse->mean);
    const auto fine = quadrature(source, place, 4);
    // The error falls with the square of the number of parts along an edge, or at a kink with this
    // number.
    const float error = brightest(glm::abs(fine->mean - coarse->mean)) / 4;
    if (error <= tolerance) return ClosedMean{fine->mean, error};
    const auto finest = quadrature(source, place, 16);
    return ClosedMean{finest->mean, brightest(glm::abs(finest->mean - fine->mean)) / 4};
}

}  // namespace raybundle
