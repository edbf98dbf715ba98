// SPDX-License-Identifier: GPL-3.0-or-later
#include "visibility/embree3.h"

#ifndef EMBREE_STATIC_LIB
#include <dlfcn.h>
#endif

namespace raybundle {
namespace {

// Looks up a function in the shared library of Embree 3, which is loaded together with this
// library. If Embree is linked statically, its functions are hidden, so that `linked` is the right
// one whatever else the process has loaded, another Embree 3 included.
template <class Function>
Function find([[maybe_unused]] const char* name, Function linked) {
#ifndef EMBREE_STATIC_LIB
    static void* const library = dlopen("libembree3.so.3", RTLD_LAZY | RTLD_NOLOAD);
    if (void* found = library ? dlsym(library, name) : nullptr)
        return reinterpret_cast<Function>(found);
#endif
    return linked;
}

}  // namespace

Embree3::Embree3()
    : newDevice(find("rtcNewDevice", &rtcNewDevice)),
      releaseDevice(find("rtcReleaseDevice", &rtcReleaseDevice)),
      getDeviceError(find("rtcGetDeviceError", &rtcGetDeviceError)),
      newBVH(find("rtcNewBVH", &rtcNewBVH)),
      releaseBVH(find("rtcReleaseBVH", &rtcReleaseBVH)),
      buildBVH(find("rtcBuildBVH", &rtcBuildBVH)),
      threadLocalAlloc(find("rtcThreadLocalAlloc", &rtcThreadLocalAlloc)),
      newScene(find("rtcNewScene", &rtcNewScene)),
      releaseScene(find("rtcReleaseScene", &rtcReleaseScene)),
      setSceneFlags(find("rtcSetSceneFlags", &rtcSetSceneFlags)),
      setSceneBuildQuality(find("rtcSetSceneBuildQuality", &rtcSetSceneBuildQuality)),
      setSceneProgressMonitorFunction(
          find("rtcSetSceneProgressMonitorFunction", &rtcSetSceneProgressMonitorFunction)),
      commitScene(find("rtcCommitScene", &rtcCommitScene)),
      newGeometry(find("rtcNewGeometry", &rtcNewGeometry)),
      releaseGeometry(find("rtcReleaseGeometry", &rtcReleaseGeometry)),
      setNewGeometryBuffer(find("rtcSetNewGeometryBuffer", &rtcSetNewGeometryBuffer)),
      setGeometryBuildQuality(find("rtcSetGeometryBuildQuality", &rtcSetGeometryBuildQuality)),
      commitGeometry(find("rtcCommitGeometry", &rtcCommitGeometry)),
      attachGeometry(find("rtcAttachGeometry", &rtcAttachGeometry)),
      intersect1(find("rtcIntersect1", &rtcIntersect1)),
      occluded1(find("rtcOccluded1", &rtcOccluded1)),
      occluded8(find("rtcOccluded8", &rtcOccluded8)) {}

const Embree3 embree3;

}  // namespace raybundle
