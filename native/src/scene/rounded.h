// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

namespace raybundle {

// Returns a value with so many binary digits. Values that are equal but for rounding errors, as in
// symmetric scenes, are then nearly always equal, and their order does not depend on the pose.
inline double rounded(double value, int digits) {
    int exponent = 0;
    const double share = std::frexp(value, &exponent);
    return std::ldexp(std::round(std::ldexp(share, digits)), exponent - digits);
}

}  // namespace raybundle
