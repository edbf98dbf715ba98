// SPDX-License-Identifier: GPL-3.0-or-later
//
// Which lines a patch that lets light through stops. The patch is treated as if it had many holes
// smaller than any pixel: a line passes with probability 1 - opacity, independently of what it met
// before. A hash of the line and the patch decides, so that repeated queries agree and the result
// does not depend on the number of threads.
//
// Differs from tracing images of leaves: the mean opacity over a patch is used, so that shadows are
// only as fine as patches. Coloured transparency is treated as grey.
#pragma once

#include <cstdint>
#include <cstring>
#include <glm/glm.hpp>

#include "patches/patches.h"
#include "sampling/mix_bits.h"

namespace raybundle {

// Returns an identifier of the line of a ray, a hash of its point and direction.
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

// Returns whether a patch stops a line. `line` is the lineName() of the line.
inline bool stops(const Patches& patches, uint32_t patch, uint64_t line) {
    const float opacity = patches.opacityOf(patch);
    return opacity >= 1 || double(mixBits(line ^ mixBits(patch)) >> 11) * 0x1p-53 < double(opacity);
}

}  // namespace raybundle
