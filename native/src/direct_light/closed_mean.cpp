// SPDX-License-Identifier: GPL-3.0-or-later
//
// If the source does not know the mean of its closed form over a patch, that is found by Gauss
// quadrature (degree 3 on a parallelogram, 2 on a triangle), on more parts of the patch where it
// varies much: beside a source it falls from a finite value at the common edge with an infinite
// slope.
#include "direct_light/closed_mean.h"

#include "patches/patches.h"
#include "scene/channels.h"

namespace raybundle {
namespace {

// A closed form whose largest value is so many times its smallest on a patch takes more points.
constexpr float kSmooth = 1.1f;

// At the points of a quadrature.
struct Quadrature {
    glm::vec3 mean{0.0f};
    glm::vec3 low{INFINITY}, high{0.0f};
};

// The patch is cut into parts * parts.
std::optional<Quadrature> quadrature(const LightSource& source, const ReceiverPlace& place,
                                     int parts) {
    // The patch cut into parts is like a parent with that grid.
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

}  // namespace

std::optional<ClosedMean> closedMean(const LightSource& source, const ReceiverPlace& place,
                                     float tolerance) {
    auto exact = [](const std::optional<glm::vec3>& mean) {
        return mean ? std::optional(ClosedMean{*mean, 0}) : std::nullopt;
    };
    if (place.radius == 0 || place.radius < source.farPatch() * source.distance(place.centroid()))
        return exact(source.irradiance(place.centroid(), place.normal));
    if (const auto mean = source.meanIrradiance(place)) return exact(mean);
    const auto coarse = quadrature(source, place, 1);
    if (!coarse) return std::nullopt;
    // The points of the quadrature alone may be alike by symmetry.
    const auto middle = source.irradiance(place.centroid(), place.normal);
    if (brightest(glm::max(coarse->high, *middle)) <=
        kSmooth * brightest(glm::min(coarse->low, *middle)))
        return exact(coarse->mean);
    const auto fine = quadrature(source, place, 4);
    // The error falls with the square of the parts, or at a kink with their number.
    const float error = brightest(glm::abs(fine->mean - coarse->mean)) / 4;
    if (error <= tolerance) return ClosedMean{fine->mean, error};
    const auto finest = quadrature(source, place, 16);
    return ClosedMean{finest->mean, brightest(glm::abs(finest->mean - fine->mean)) / 4};
}

}  // namespace raybundle
