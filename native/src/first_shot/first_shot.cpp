// SPDX-License-Identifier: GPL-3.0-or-later
#include "first_shot/first_shot.h"

namespace raybundle {
namespace {

struct Kind {
    FirstShotKind value;
    FirstShot (*shoot)(const FirstShotInput& input);
};

constexpr Kind kKinds[] = {
    {FirstShotKind::GATHER, gather},
    {FirstShotKind::SHOOT, shoot},
    {FirstShotKind::EXTENDED, extendedFirstShot},
};
static_assert(hasEveryValue(kKinds));

}  // namespace

glm::vec3 shotReflectance(const Patches& patches, const FirstShot& shot, size_t side) {
    if (patches.byAngle.empty() || shot.angles.empty()) return patches.reflectance[side];
    return glm::clamp(patches.reflectance[side] +
                          sumOfTerms(patches.byAngle[side], shot.angles[side] - kEverywhere),
                      0.0f, 1.0f);
}

FirstShot firstShot(FirstShotKind kind, const FirstShotInput& input) {
    return kKinds[size_t(kind)].shoot(input);
}

}  // namespace raybundle
