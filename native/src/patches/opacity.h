// SPDX-License-Identifier: GPL-3.0-or-later
//
// Which lines a patch that lets light through stops. A patch is treated as if it had many holes
// smaller than any pixel: a line goes on with probability 1 - opacity, whatever came before it on
// the line. A hash of line and patch decides, so that whoever asks twice gets the same answer and
// the result does not depend on the number of threads.
//
// Differs from tracing images of leaves: the mean opacity over a patch is used, so their shadows
// are as fine as patches; coloured transparency is grey.
#pragma once

#include <cstdint>
#include <cstring>
#include <glm/glm.hpp>

#include "bundles/directions.h"
#include "patches/patches.h"

namespace raybundle {

// Mixes the bits of a number (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number
// Generators", 2014).
inline uint64_t mixBits(uint64_t x) {
    x += 0x9e3779b97f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
}

// Names for lines: of a bundle, to be joined with a pixel, and of a ray.
inline uint64_t lineName(const Bundle& bundle) {
    uint64_t name = mixBits(uint64_t(bundle.half) << 32 | bundle.index);
    // The grid's shift carries the seed of the directions.
    for (double x : {bundle.shift.x, bundle.shift.y}) {
        uint64_t bits;
        std::memcpy(&bits, &x, sizeof bits);
        name = mixBits(name ^ bits);
    }
    return name;
}

inline uint64_t lineName(const glm::vec3& point, const glm::vec3& direction) {
    uint64_t name = 0;
    for (const glm::vec3& v : {point, direction})
        for (int k = 0; k < 3; ++k) {
            uint32_t bits;
            std::memcpy(&bits, &v[k], sizeof bits);
            name = mixBits(name ^ bits);
        }
    return name;
}

// Whether a patch stops a line.
inline bool stops(const Patches& patches, uint32_t patch, uint64_t line) {
    const float opacity = patches.opacityOf(patch);
    return opacity >= 1 || double(mixBits(line ^ mixBits(patch)) >> 11) * 0x1p-53 < double(opacity);
}

}  // namespace raybundle
