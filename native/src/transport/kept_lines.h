// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "transport/scattered_light.h"

namespace raybundle {

// Lines along which drafts take light by direction: for each side some of its lines, in place of
// all. Which these are depends on the patches and on the bundles, but not on the light, so that the
// drafts while a lamp moves choose them once.
struct KeptLines {
    struct Line {
        uint32_t from = 0;  // side from which the line comes
        float share = 0;    // the exitance of `from` times this is the irradiance by the line
        ScatteredLight::Place place;  // of the line in the cells of `from`
    };
    size_t ofSide = 0;        // largest number of lines of a side
    std::vector<Line> lines;  // `ofSide` per side; those that do not exist have the share 0
};

}  // namespace raybundle
