// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bright spots: few sides that the first shot leaves so much light on that what they reflect is
// like the light of a lamp. A bulb close to a wall, a spot on a ceiling, sun on the floor of a dark
// room: few lines of a bundle meet them, and those bring most of the light, so that bundles need
// very many. Their reflected light is gathered with shadow rays like that of sources, once; the
// bundles carry the rest.
//
// Sources: thesis chapter 3 (extended first shot): what is brighter than the rest is shot once
// more. Differs:
// - Gathered where it arrives and not shot, like the light of the sources (first_shot/gather.cpp).
// - Once, and only where it takes less time than the bundles that would be needed otherwise.
#pragma once

#include "bundles/line_windows.h"
#include "first_shot/first_shot.h"

namespace raybundle {

// Gathers the reflected light of bright spots, if there are any: fills indirect and unshot of a
// shot of GATHER and adds to its errors. exchange: what surfaces that reflect see of each other;
// density: of the lines to come. Returns how many sides are bright spots. Where light comes out of
// the other side of surfaces there are none. What surfaces send otherwise than Lambert's do,
// bundles add.
size_t gatherBrightSpots(const Scene& scene, const FirstShotInput& input,
                         const Visibility& exchange, const LineDensity& density, FirstShot& shot);

}  // namespace raybundle
