// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <tuple>
#include <vector>

#include "patches/patches.h"
#include "patches/welding.h"

namespace raybundle {

// Whether a surface encloses a volume, and whether the fronts of its faces look out of that volume
// (OUTWARD) or into it (INWARD).
enum class Shell : uint8_t { OPEN, OUTWARD, INWARD };

// Returns per surface whether it is closed: along each edge, as many faces run in one direction as
// in the other. An edge may have more than two faces. For example, welded edges have four faces
// where two boxes with split edges stand against each other.
std::vector<bool> closedSurfaces(const WeldedFaces& faces);

// Returns per face whether it belongs to a closed surface that encloses a volume. `places` holds
// the positions of the vertices, m. A surface counts as OPEN if it is no thicker than `thinnest`
// returns for one of its vertices, m. Two surfaces of one instance that coincide within rounding
// with opposite orientations also count as OPEN, because such a shell receives light on both sides.
std::vector<Shell> shellsOfFaces(const WeldedFaces& faces, const std::vector<bool>& closed,
                                 const std::vector<glm::vec3>& places,
                                 const std::function<double(uint32_t)>& thinnest);

// Returns whether parent a comes before parent b along a direction, for two parallel surfaces in
// the same place, whose order depth cannot tell. `aEnters` is whether the direction arrives at the
// front of parent a, `bEnters` whether it arrives at the front of parent b.
//
// The order follows from solids. A surface through which the direction leaves a solid comes first,
// then sheets, then a surface through which the direction enters the next solid. No light then
// passes between a cupboard and the wall it stands against. Sheets whose fronts the direction
// arrives at come before sheets whose backs it arrives at. Of two surfaces of equal kind, the
// smaller one lies on the front of the larger one, as a lamp or a picture lies on a wall, whatever
// their order in the scene. Surfaces of equal size are ordered by index, so that both directions
// give one order. (Depth gives the order of surfaces that meet at an angle.)
inline bool comesBefore(const Patches& patches, uint32_t a, bool aEnters, uint32_t b,
                        bool bEnters) {
    auto rank = [&](uint32_t index, bool enters) {
        const Parent& parent = patches.parents[index];
        const int kind = !parent.isSolid ? 1 : enters ? 2 : 0;
        const int64_t size = parent.surfaceSize;
        return std::make_tuple(kind, !enters, enters ? size : -size,
                               enters ? -int64_t(index) : int64_t(index));
    };
    return rank(a, aEnters) < rank(b, bEnters);
}

// Returns whether two sides point against each other, as sides that touch do. Surfaces that meet at
// an angle are close only at their common edge, and see each other.
inline bool pointAgainst(const Patches& patches, uint32_t side, uint32_t other) {
    constexpr float kOpposite = -0.99f;  // cosine of the angle between the normals
    return glm::dot(patches.normal(side), patches.normal(other)) < kOpposite;
}

// Returns whether two parents are parallel, within the rounding errors of coinciding faces.
inline bool areParallel(const Parent& a, const Parent& b) {
    const glm::dvec3 n = glm::cross(glm::dvec3(a.a), glm::dvec3(a.b));
    const glm::dvec3 m = glm::cross(glm::dvec3(b.a), glm::dvec3(b.b));
    const double cosine = glm::dot(n, m);
    return cosine * cosine > 0.9999 * glm::dot(n, n) * glm::dot(m, m);
}

}  // namespace raybundle
