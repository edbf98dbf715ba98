// SPDX-License-Identifier: GPL-3.0-or-later
#include "first_shot/first_shot.h"

#include <algorithm>
#include <cassert>

namespace raybundle {
namespace {

struct Kind {
    const char* name;
    FirstShot (*shoot)(const FirstShotInput& input);
};

constexpr Kind kKinds[] = {
    {"GATHER", gather},
    {"SHOOT", shoot},
    {"EXTENDED", extendedFirstShot},
};

}  // namespace

glm::vec3 shotReflectance(const Patches& patches, const FirstShot& shot, size_t side) {
    if (patches.byAngle.empty() || shot.angles.empty()) return patches.reflectance[side];
    return glm::clamp(patches.reflectance[side] +
                          sumOfTerms(patches.byAngle[side], shot.angles[side] - kEverywhere),
                      0.0f, 1.0f);
}

FirstShot firstShot(const std::string& kind, const FirstShotInput& input) {
    const auto row = std::find_if(std::begin(kKinds), std::end(kKinds),
                                  [&](const Kind& k) { return kind == k.name; });
    assert(row != std::end(kKinds) && "settings know the names");
    return row->shoot(input);
}

}  // namespace raybundle
