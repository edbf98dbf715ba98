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

#include "patches/patches.h"
#include "sampling/mix_bits.h"

namespace raybundle {

// Name of a ray, which is a line.
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
