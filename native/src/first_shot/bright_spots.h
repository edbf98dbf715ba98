// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bright spots: a few sides on which the first shot leaves so much light that they act as lamps,
// such as a wall close to a bulb, a spot on a ceiling, or sunlight on the floor of a dark room. Few
// lines of a bundle meet them, but these lines carry most of the light, so that very many bundles
// would be needed. Their reflected light is gathered once with shadow rays, like the light of
// sources. The bundles carry the rest.
//
// Sources: thesis chapter 3 (extended first shot): what is brighter than the rest is shot once
// more.
// Differs:
// - The light is gathered where it arrives and not shot, like that of the sources
//   (first_shot/gather.cpp).
// - Bright spots that see each other, as inside the shade of a lamp, light each other. What they
//   reflect of that light is gathered too, in further rounds (not if any surface is not Lambert's).
// - The first round is made only if it takes less time than the bundles that would be needed
//   otherwise, a further round only if it saves very many bundles.
#pragma once

#include "bundles/line_windows.h"
#include "first_shot/first_shot.h"

namespace raybundle {

// Gathers the reflected light of bright spots, if there are any. Fills `indirect` and `unshot` of a
// shot of GATHER, and adds to its errors. Returns the number of sides that are bright spots.
//   exchange  visibility between surfaces that reflect light to each other
//   density   density of the lines that will be traced
// There are no bright spots in scenes with translucent or partly transparent surfaces. Bundles add
// the light that surfaces which are not Lambert's send otherwise than by Lambert's law.
size_t gatherBrightSpots(const Scene& scene, const FirstShotInput& input,
                         const Visibility& exchange, const LineDensity& density, FirstShot& shot);

}  // namespace raybundle
