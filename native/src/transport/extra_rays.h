// SPDX-License-Identifier: GPL-3.0-or-later
//
// Extra rays: local rays at sides where the lines of bundles leave too much noise. A bundle
// distributes its lines over the scene by area. Small, dark or contrasty places would need
// thousands of bundles for an accuracy that some hundred rays of their own give.
//
// Source: thesis section 2.4.2 (local lines, fig. 2.11), as a last bounce of the solved light
// (Reichert 1992, see reconstruction/final_gather.h).
// Differs:
// - Rays start all over the patch, so that they estimate its mean as lines do. Both estimates are
//   joined, weighted by the number of lines that each is worth.
// - The power that all these sides absorb together stays as the lines gave it, up to a
//   ten-thousandth of all absorbed power, because lines keep the energy balance.
// - Half of the rays of a side see the light that the first half of the bundles found, and the
//   other half see the light of the second half. The two halves thus remain independent, and their
//   difference remains a measure of the noise.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "patches/patches.h"
#include "transport/set_light.h"
#include "visibility/visibility.h"

namespace raybundle {

// Number of lines that one ray is worth. The rays of a side are stratified over the hemisphere,
// while lines meet the side at random. Measured by the noise of cornell_box: 64, 256 and 1024 rays
// per side are as good as 190, 600 and 1700 lines.
constexpr float kLinesOfRay = 2;

// The number of rays that a side is to cast.
struct ExtraRays {
    uint32_t side;
    uint32_t rays;  // must be even
};

// The rays to cast, and the surfaces. All references must outlive the object.
struct ExtraRaysInput : LitSurfaces {
    const Visibility& visibility;
    const std::vector<ExtraRays>& wanted;
    // Seed of the rays; calls with different seeds cast different rays.
    const uint32_t seed;
};

// Casts the rays of the wanted sides, and adds the light that they bring to the irradiance of each
// light set and to the estimates of its two halves. `samples` is per side and half the number of
// lines that met the side. The rays are added to it, each as kLinesOfRay lines. A ray that meets a
// side that no line of a half has met is left out, because that half has no light there. `halves`
// is per light of `lights`.
void addExtraRays(const ExtraRaysInput& input, std::vector<std::array<float, 2>>& samples,
                  SetLights& lights, std::vector<std::array<Irradiance, 2>>& halves);

}  // namespace raybundle
