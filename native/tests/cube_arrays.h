// SPDX-License-Identifier: GPL-3.0-or-later
//
// A unit cube with its fronts inside, in the arrays of rb_add_mesh.
#pragma once

#include <cstdint>

namespace raybundle::test {

inline constexpr float kVertices[24] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0,
                                        0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
inline constexpr int32_t kCorners[24] = {0, 1, 2, 3, 4, 7, 6, 5, 0, 4, 5, 1,
                                         1, 5, 6, 2, 2, 6, 7, 3, 3, 7, 4, 0};
inline constexpr int32_t kFaces[7] = {0, 4, 8, 12, 16, 20, 24};

}  // namespace raybundle::test
