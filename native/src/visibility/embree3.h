// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <embree3/rtcore.h>

namespace raybundle {

// The functions of Embree 3, each looked up in the library of Embree 3. Embree 4 exports functions
// of the same names without symbol versions. If a process has loaded Embree 4 first, as official
// Blender does, a plain call would reach Embree 4 and end the process.
struct Embree3 {
    Embree3();

    decltype(&rtcNewDevice) newDevice;
    decltype(&rtcReleaseDevice) releaseDevice;
    decltype(&rtcGetDeviceError) getDeviceError;
    decltype(&rtcNewBVH) newBVH;
    decltype(&rtcReleaseBVH) releaseBVH;
    decltype(&rtcBuildBVH) buildBVH;
    decltype(&rtcThreadLocalAlloc) threadLocalAlloc;
    decltype(&rtcNewScene) newScene;
    decltype(&rtcReleaseScene) releaseScene;
    decltype(&rtcSetSceneFlags) setSceneFlags;
    decltype(&rtcSetSceneBuildQuality) setSceneBuildQuality;
    decltype(&rtcSetSceneProgressMonitorFunction) setSceneProgressMonitorFunction;
    decltype(&rtcCommitScene) commitScene;
    decltype(&rtcNewGeometry) newGeometry;
    decltype(&rtcReleaseGeometry) releaseGeometry;
    decltype(&rtcSetNewGeometryBuffer) setNewGeometryBuffer;
    decltype(&rtcSetGeometryBuildQuality) setGeometryBuildQuality;
    decltype(&rtcCommitGeometry) commitGeometry;
    decltype(&rtcAttachGeometry) attachGeometry;
    decltype(&rtcIntersect1) intersect1;
    decltype(&rtcOccluded1) occluded1;
    decltype(&rtcOccluded8) occluded8;
};

// The functions, looked up when this library is loaded.
extern const Embree3 embree3;

}  // namespace raybundle
