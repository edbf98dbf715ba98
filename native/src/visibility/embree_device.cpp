// SPDX-License-Identifier: GPL-3.0-or-later
#include "visibility/embree_device.h"

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <system_error>
#include <thread>

#include "visibility/embree3.h"

namespace raybundle {
namespace {

// Builds a tree of one box, which Embree does in the calling thread. Returns whether this succeeds.
// May throw std::bad_alloc if Embree has no memory for its own error.
bool buildLeastTree(RTCDevice device) {
    const std::unique_ptr<RTCBVHTy, decltype(&rtcReleaseBVH)> tree(embree3.newBVH(device),
                                                                   embree3.releaseBVH);
    if (!tree) return false;
    RTCBuildPrimitive box = {};
    box.upper_x = box.upper_y = box.upper_z = 1;
    RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.bvh = tree.get();
    arguments.primitives = &box;
    arguments.primitiveCount = arguments.primitiveArrayCapacity = 1;
    arguments.createNode = [](RTCThreadLocalAllocator memory, unsigned, void*) {
        return embree3.threadLocalAlloc(memory, 16, 16);
    };
    arguments.setNodeChildren = [](void*, void**, unsigned, void*) {};
    arguments.setNodeBounds = [](void*, const RTCBounds**, unsigned, void*) {};
    arguments.createLeaf = [](RTCThreadLocalAllocator memory, const RTCBuildPrimitive*, size_t,
                              void*) { return embree3.threadLocalAlloc(memory, 16, 16); };
    return embree3.buildBVH(&arguments) != nullptr;
}

}  // namespace

RTCDeviceTy* newEmbreeDevice() {
    std::string configuration = "tessellation_cache_size=0";
    if (const char* more = std::getenv("RAYBUNDLE_EMBREE"))
        configuration += std::string(",") + more;
    return embree3.newDevice(configuration.c_str());
}

void makeRoomForTreeBuilders() {
    static std::mutex mutex;
    static size_t callers = 0;  // number of threads that have called this function
    static size_t ended = 0;    // number of threads in Embree's list that ended at once
    thread_local bool isKnown = false;
    const std::lock_guard lock(mutex);
    if (!isKnown) ++callers;
    isKnown = true;

    // oneTBB's workers build trees, too. The list doubles whenever it is full. With `room` + 1
    // threads in it, it therefore has space for `room` - 1 more.
    const size_t builders = callers + 2 * std::thread::hardware_concurrency();
    size_t room = 1;
    while (room <= builders) room *= 2;
    if (ended > room) return;
    const std::unique_ptr<RTCDeviceTy, decltype(&rtcReleaseDevice)> device(newEmbreeDevice(),
                                                                           embree3.releaseDevice);
    for (; ended <= room; ++ended) {
        bool isBuilt = false;
        try {
            std::thread([&] {
                try {
                    isBuilt = device && buildLeastTree(device.get());
                } catch (const std::bad_alloc&) {
                    // The tree is not built, which is reported below.
                }
            }).join();
        } catch (const std::system_error&) {
            // No thread can be started. Go on without the room; it is only needed if memory runs
            // out.
            return;
        }
        if (!isBuilt) throw std::bad_alloc();
    }
}

}  // namespace raybundle
