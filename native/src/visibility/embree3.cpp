// SPDX-License-Identifier: GPL-3.0-or-later
#include "visibility/embree3.h"

#include <dlfcn.h>

#include <stdexcept>
#include <string>

namespace raybundle {
namespace {

template <class Function>
void find(void* library, const char* name, Function& function) {
    function = reinterpret_cast<Function>(dlsym(library, name));
    if (!function) throw std::runtime_error(std::string("Embree 3 has no function ") + name);
}

}  // namespace

Embree3::Embree3() {
    // This library is linked with it, so that it is there already.
    void* library = dlopen("libembree3.so.3", RTLD_LAZY | RTLD_NOLOAD);
    if (!library) library = RTLD_DEFAULT;  // linked in statically
    find(library, "rtcNewDevice", newDevice);
    find(library, "rtcReleaseDevice", releaseDevice);
    find(library, "rtcGetDeviceError", getDeviceError);
    find(library, "rtcNewBVH", newBVH);
    find(library, "rtcReleaseBVH", releaseBVH);
    find(library, "rtcBuildBVH", buildBVH);
    find(library, "rtcThreadLocalAlloc", threadLocalAlloc);
    find(library, "rtcNewScene", newScene);
    find(library, "rtcReleaseScene", releaseScene);
    find(library, "rtcSetSceneFlags", setSceneFlags);
    find(library, "rtcCommitScene", commitScene);
    find(library, "rtcNewGeometry", newGeometry);
    find(library, "rtcReleaseGeometry", releaseGeometry);
    find(library, "rtcSetNewGeometryBuffer", setNewGeometryBuffer);
    find(library, "rtcCommitGeometry", commitGeometry);
    find(library, "rtcAttachGeometry", attachGeometry);
    find(library, "rtcIntersect1", intersect1);
    find(library, "rtcOccluded1", occluded1);
    find(library, "rtcOccluded8", occluded8);
}

const Embree3 embree3;

}  // namespace raybundle
