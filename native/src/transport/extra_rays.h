// SPDX-License-Identifier: GPL-3.0-or-later
//
// Local rays beside the lines of bundles, at sides where these leave too much noise: a bundle
// spreads its lines over the scene by area, and small, dark or contrasty places would need
// thousands of bundles for what some hundred rays of their own bring.
//
// Source: thesis section 2.4.2 (local lines, fig. 2.11), as a last bounce of the solved light
// (Reichert 1992, see reconstruction/final_gather.h).
// Differs:
// - Rays leave all over the patch, so that they estimate what lines do, its mean; both are joined,
//   weighed by how much they tell.
// - What all these sides absorb together stays what the lines had it, up to a ten-thousandth of all
//   that is absorbed: lines keep the balance of energy.
// - Half of the rays of a side sees the light that the first half of the bundles has found, the
//   other half that of the second: the two halves still err independently, and tell the noise.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "patches/patches.h"
#include "transport/set_light.h"
#include "visibility/visibility.h"

namespace raybundle {

// Rays of a side are spread evenly over the hemisphere: one tells as much as so many lines, which
// meet it as they come (measured by the noise of cornell_box: 64, 256 and 1024 rays a side are as
// good as 190, 600 and 1700 lines).
constexpr float kLinesOfRay = 2;

struct ExtraRays {
    uint32_t side;
    uint32_t rays;  // even
};

// What rays are cast, and where. References must outlive it.
struct ExtraRaysInput : LitSurfaces {
    const Visibility& visibility;
    const std::vector<ExtraRays>& wanted;
    const uint32_t seed;
};

// Adds what the rays of some sides bring to the light of each set, and to the estimates of its two
// halves, all as they arrive. samples: per side and half, how many lines have met it; these rays
// are added to them, by what they tell. Rays that meet a side of which a half knows nothing do not
// count. halves: per light of `lights`.
void addExtraRays(const ExtraRaysInput& input, std::vector<std::array<float, 2>>& samples,
                  SetLights& lights, std::vector<std::array<Irradiance, 2>>& halves);

}  // namespace raybundle
