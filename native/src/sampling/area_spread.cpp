// SPDX-License-Identifier: GPL-3.0-or-later
#include "sampling/area_spread.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "sampling/sphere_sampling.h"

namespace raybundle {
namespace {

constexpr double kLeastHalf = 1e-3;  // radians; smaller half spreads are clamped to this
constexpr double kWholeHalf = 1e-5;  // radians; half spreads closer to pi/2 than this count as pi/2
constexpr double kSeriesHalf = 0.05;  // radians; below this, series replace formulas that cancel
constexpr int kBisections = 30;       // bisection steps to invert the integral

// Returns angle - sin(angle) cos(angle), with `angle` in radians. Small angles use the Taylor
// series because the difference would cancel.
double segment(double angle) {
    const double a2 = angle * angle;
    if (angle < kSeriesHalf) return angle * a2 * (2.0 / 3 - a2 * (2.0 / 15 - a2 * 4 / 315));
    return angle - std::sin(angle) * std::cos(angle);
}

}  // namespace

AreaSpread::AreaSpread(double spread)
    : half(std::clamp(0.5 * spread, kLeastHalf, glm::half_pi<double>())), cotangent(0) {
    if (half >= glm::half_pi<double>() - kWholeHalf) {
        half = glm::half_pi<double>();
        return;
    }
    cotangent = 1 / std::tan(half);
    const double h2 = half * half;
    total =
        half < kSeriesHalf ? h2 * (1.0 / 3 + h2 * (1.0 / 45 + h2 * 2 / 945)) : 1 - half * cotangent;
}

float AreaSpread::factor(float cosine) const {
    if (isWhole()) return 1;
    if (cosine <= 0) return 0;
    const double c = std::min(1.0, double(cosine));
    return float(std::max(0.0, 1 - cotangent * std::sqrt(1 - c * c) / c) / total);
}

// Returns `total` times the integral of 2 factor(cos t) sin t cos t over t from 0 to `angle`. The
// angle is in radians, from 0 to `half`.
double AreaSpread::integral(double angle) const {
    const double s = std::sin(angle);
    return s * s - cotangent * segment(angle);
}

glm::vec3 AreaSpread::emit(const glm::vec3& normal, glm::vec2 uv) const {
    if (isWhole()) return cosineDirection(normal, uv);
    // onDisk() returns points whose radius is the sine of the angle of a cosine distribution. Keep
    // the azimuth of the point, but choose the angle at which the integral reaches the share (the
    // squared radius) that the cosine distribution has within the point's radius.
    const glm::vec2 d = onDisk(uv);
    const double share = double(glm::dot(d, d)), wanted = share * integral(half);
    double low = 0, high = half;
    for (int k = 0; k < kBisections; ++k) {
        const double middle = 0.5 * (low + high);
        (integral(middle) < wanted ? low : high) = middle;
    }
    const double angle = 0.5 * (low + high);
    const glm::vec2 across = share > 0 ? d * float(std::sin(angle) / std::sqrt(share)) : d;
    const auto [x, y] = frame(normal);
    return x * across.x + y * across.y + normal * float(std::cos(angle));
}

}  // namespace raybundle
