// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

struct RTCDeviceTy;  // Embree's, of which nothing else needs to know

namespace raybundle {

// A device for triangles and quads, which the caller releases; null if it fails. Embree 3 else maps
// 128 MB for surfaces that it subdivides, of which there are none here; and where that fails it
// waits forever when the device is released (3.13.5, SharedLazyTessellationCache). What the
// variable RAYBUNDLE_EMBREE of the environment says is added to Embree's configuration:
// "isa=sse4.2" takes the kernels of the oldest processors that this library runs on. Throws
// std::bad_alloc.
RTCDeviceTy* newEmbreeDevice();

// Embree keeps a list of the threads that ever built a tree. Where it cannot grow for one of them,
// that thread keeps a pointer to what is freed, and the next tree that it builds waits forever for
// a lock in it (3.13.5, FastAllocator::threadLocal2: push_back throws). Nothing in Embree's
// interface takes the pointer back. So, before a thread builds trees, the list is made long enough,
// by threads that end at once and take such a pointer with them. To be called while oneTBB starts
// no threads, which ends the process if none can be started. Throws std::bad_alloc.
void makeRoomForTreeBuilders();

}  // namespace raybundle
