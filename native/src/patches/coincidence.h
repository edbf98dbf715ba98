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

// Whether a surface encloses a volume, and whether its faces wind about that outwards.
enum class Shell : uint8_t { OPEN, OUTWARD, INWARD };

// Per surface: whether it is closed, that is, whether each edge of it has as many faces on one side
// as on the other, which turn alike. (Where two boxes with split edges stand against each other,
// welded edges have four faces.)
std::vector<bool> closedSurfaces(const WeldedFaces& faces);

// Per face: whether it belongs to a closed surface that encloses a volume. places: of the vertices,
// metres. Surfaces that are no thicker than `thinnest` (per vertex, metres) do not, and neither do
// two of one instance that lie in the same place, within rounding, and are turned each to another
// side: such a shell has light on both sides.
std::vector<Shell> shellsOfFaces(const WeldedFaces& faces, const std::vector<bool>& closed,
                                 const std::vector<glm::vec3>& places,
                                 const std::function<double(uint32_t)>& thinnest);

// Which of two parallel surfaces that lie in the same place comes first along a direction. Depth
// cannot tell, but solids can: the surface by which the direction leaves a solid comes before any
// sheet between, and that before the surface by which it enters the next solid; so nothing shines
// between a cupboard and the wall it stands against. Of sheets, those whose fronts the direction
// looks at come before those that it sees from behind. Of two of a kind the smaller one lies on the
// front of the larger one, as a lamp or a picture on a wall does, whatever their order in the
// scene; only where they are as large their indices decide, the same from both directions. (Of
// surfaces that meet at an angle, depth knows the order.) aEnters: the direction looks at the front
// of parent a.
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

// Whether two parents are parallel, within what rounding does to coinciding faces.
inline bool areParallel(const Parent& a, const Parent& b) {
    const glm::dvec3 n = glm::cross(glm::dvec3(a.a), glm::dvec3(a.b));
    const glm::dvec3 m = glm::cross(glm::dvec3(b.a), glm::dvec3(b.b));
    const double cosine = glm::dot(n, m);
    return cosine * cosine > 0.9999 * glm::dot(n, n) * glm::dot(m, m);
}

}  // namespace raybundle
