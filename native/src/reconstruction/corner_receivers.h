// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "direct_light/direct_light.h"
#include "patches/patches.h"
#include "reconstruction/least_squares.h"
#include "scene/scene.h"
#include "visibility/visibility.h"

namespace raybundle {

// A corner of a mesh that receives light.
struct CornerReceiver {
    int32_t corner = 0;  // corner of the instance's mesh
    glm::vec3 vertex;    // position of the corner, m, relative to Patches::centre
    Receiver receiver;
    bool isBesideGap = false;  // the light of the patches there does not represent it
};

// Returns the receivers at those corners of an instance's mesh that lie on patches. Each receiver
// lies slightly inside its face, so that at the edge of a room the next wall is beside the receiver
// and does not contain it. The receiver has the shading normal of the corner. `range` holds the
// parents of the instance.
std::vector<CornerReceiver> cornerReceivers(const Scene& scene, const Patches& patches,
                                            uint32_t instance, const InstanceRange& range);

// Moves a receiver closer to its corner if another surface lies so near in front of it that both
// are in a narrow gap. The receiver then lies beside the gap, as the corner does: a surface at this
// distance hides no more of the surroundings from the receiver than it hides from the corner. Sets
// `isBesideGap` if the receiver was moved.
void leaveGap(CornerReceiver& corner, const Patches& patches, const Visibility& visibility);

// Returns whether another surface touches the side at the receiver's point. The surface may touch
// the patch there although most of the patch is exposed.
bool isTouched(const Receiver& receiver, const Patches& patches, const Visibility& visibility);

}  // namespace raybundle
