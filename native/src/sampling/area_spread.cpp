// SPDX-License-Identifier: GPL-3.0-or-later
#include "sampling/area_spread.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "sampling/sphere_sampling.h"

namespace raybundle {
namespace {

constexpr double kLeastHalf = 1e-3;   // radians; narrower ones count as this wide
constexpr double kWholeHalf = 1e-5;   // below a quarter turn by less than this is a quarter turn
constexpr double kSeriesHalf = 0.05;  // below it differences would lose their digits
constexpr int kBisections = 30;       // to invert the integral

// angle - sin angle cos angle.
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

// Of 2 factor sin cos from 0 to an angle, times `total`.
double AreaSpread::integral(double angle) const {
    const double s = std::sin(angle);
    return s * s - cotangent * segment(angle);
}

glm::vec3 AreaSpread::emit(const glm::vec3& normal, glm::vec2 uv) const {
    if (isWhole()) return cosineDirection(normal, uv);
    // The radius on the disk is the sine for a cosine distribution: replace it.
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
