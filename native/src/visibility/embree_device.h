// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

struct RTCDeviceTy;  // Embree's type, declared here to keep Embree's headers out

namespace raybundle {

// Returns a new Embree device for triangles and quads, or null on failure. The caller must release
// it. The tessellation cache is disabled: by default Embree 3 maps 128 MB for subdivision surfaces,
// which are not used here, and if this allocation fails, Embree waits forever when the device is
// released (3.13.5, SharedLazyTessellationCache). The value of the environment variable
// RAYBUNDLE_EMBREE is added to Embree's configuration. For example, "isa=sse4.2" selects the
// kernels of the oldest processors that this library runs on. Throws std::bad_alloc.
RTCDeviceTy* newEmbreeDevice();

// Makes room for the calling thread, and for oneTBB's workers, in Embree's list of the threads that
// ever built a tree. If the list cannot grow for a thread, this thread keeps a pointer to freed
// memory, and the next tree that it builds waits forever for a lock in it (3.13.5,
// FastAllocator::threadLocal2: push_back throws). Embree's interface offers no way to take the
// pointer back. Therefore the list is extended before a thread builds trees, by threads that end at
// once and take such a pointer with them. Must be called while oneTBB starts no threads, since
// oneTBB ends the process if a thread cannot be started. Throws std::bad_alloc.
void makeRoomForTreeBuilders();

}  // namespace raybundle
