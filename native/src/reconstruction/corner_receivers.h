// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "direct_light/direct_light.h"
#include "patches/patches.h"
#include "reconstruction/least_squares.h"
#include "scene/scene.h"
#include "visibility/visibility.h"

namespace raybundle {

// A corner of a mesh as a receiver of light.
struct CornerReceiver {
    int32_t corner = 0;  // of the instance's mesh
    glm::vec3 vertex;    // where the corner is, relative to Patches::centre
    Receiver receiver;
    bool isBesideGap = false;  // the patches there tell nothing of its light
};

// The corners of an instance's mesh that lie on patches, each a little inside its face, so that the
// next wall of a room is beside it and not around it, with its shading normal.
std::vector<CornerReceiver> cornerReceivers(const Scene& scene, const Patches& patches,
                                            uint32_t instance, const InstanceRange& range);

// Moves a receiver so near to its corner that it is beside a narrow gap with the corner, and not in
// it: another surface this far in front of it hides no more of what the corner sees than it would
// there.
void leaveGap(CornerReceiver& corner, const Patches& patches, const Visibility& visibility);

}  // namespace raybundle
