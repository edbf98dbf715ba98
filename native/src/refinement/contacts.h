// SPDX-License-Identifier: GPL-3.0-or-later
//
// Contacts: tiles beside a gap that is narrower than a quarter of their width, of which only a part
// is near another surface, such as a table under the rim of a plate or under a knife. The light
// that such a tile sends into the gap is not its mean light, and the light that it gets varies over
// it. Therefore it is cut into sixteen patches. Only the geometry decides, not the light, so that
// light sets get the same cuts whether they are baked together or separately. (Surfaces that touch
// have no gap; there the exposed share of a patch is used.)
//
// Source: cutting elements until they are small relative to their distance is the rule of
// hierarchical radiosity: Hanrahan, Salzman, Aupperle, "A Rapid Hierarchical Radiosity Algorithm"
// (1991).
// Differs: only tiles at narrow gaps are cut, and only once. The gaps are found by single rays
// along the normals, from the small surface to the large one and back, instead of by the form
// factors of pairs.
#pragma once

#include <cstddef>

#include "patches/cuts.h"
#include "patches/patches.h"
#include "visibility/visibility.h"

namespace raybundle {

// Returns the cuts at contacts of a subdivision without cuts. Tiles of dense surfaces
// (Patches::isDense) are cut only if `cutsDense` is true. The cuts add at most `most` patches; if
// this does not suffice, all cuts are coarser.
Cuts contactCuts(const Patches& patches, const Visibility& visibility, size_t most,
                 bool cutsDense = true);

}  // namespace raybundle
