// SPDX-License-Identifier: GPL-3.0-or-later
//
// Contacts: tiles beside a gap less than a quarter of their width, and only in part near another
// surface, as a table under the rim of a plate or under a knife. What such a tile sends into the
// gap is not its mean light, and what it gets is not the same all over it; so it is cut into
// sixteen. Only the geometry says so, and not the light: light sets baked together have the
// same cuts as baked alone. (Surfaces that touch have no gap; there the exposed share of a patch
// counts.)
//
// Source: that elements are cut until they are small beside their distance is the rule of
// hierarchical radiosity: Hanrahan, Salzman, Aupperle, "A Rapid Hierarchical Radiosity Algorithm"
// (1991).
// Differs: only at narrow gaps, and once; found by single rays along the normals, from the small
// surface to the large one and back, instead of by the form factors of pairs.
#pragma once

#include <cstddef>

#include "patches/cuts.h"
#include "patches/patches.h"
#include "visibility/visibility.h"

namespace raybundle {

// The cuts of an uncut subdivision at contacts. At most maxPatches patches come out; where that is
// not enough, all cuts are coarser.
Cuts contactCuts(const Patches& patches, const Visibility& visibility, size_t maxPatches);

}  // namespace raybundle
