// SPDX-License-Identifier: GPL-3.0-or-later
//
// The two sides of a patch as indices: side 2 * patch is its front, 2 * patch + 1 its back. Arrays
// per patch side are in this order.
#pragma once

namespace raybundle {

// Returns the patch that a side belongs to.
template <class Index>
constexpr Index patchOf(Index side) {
    return side / 2;
}

// Returns whether a side is the back of its patch. As a number, false is a front and true a back.
template <class Index>
constexpr bool isBack(Index side) {
    return side % 2 == 1;
}

// Returns a side of a patch: the front or the back.
template <class Index>
constexpr Index sideOf(Index patch, bool isBack) {
    return 2 * patch + Index(isBack);
}

// Returns the other side of the same patch.
template <class Index>
constexpr Index opposite(Index side) {
    return side ^ 1;
}

}  // namespace raybundle
