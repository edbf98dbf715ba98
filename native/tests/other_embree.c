/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A library that exports the names of Embree's functions, like another version of Embree. Each
 * function ends the process. It is loaded before the library under test, which must not call it. */
#include <stdio.h>
#include <stdlib.h>

static void end(const char* name) {
    fprintf(stderr, "another Embree was called: %s\n", name);
    abort();
}

#define FUNCTION(name) \
    void name(void);   \
    void name(void) { end(#name); }

FUNCTION(rtcNewDevice)
FUNCTION(rtcReleaseDevice)
FUNCTION(rtcGetDeviceError)
FUNCTION(rtcNewBVH)
FUNCTION(rtcReleaseBVH)
FUNCTION(rtcBuildBVH)
FUNCTION(rtcThreadLocalAlloc)
FUNCTION(rtcNewScene)
FUNCTION(rtcReleaseScene)
FUNCTION(rtcSetSceneFlags)
FUNCTION(rtcSetSceneBuildQuality)
FUNCTION(rtcSetSceneProgressMonitorFunction)
FUNCTION(rtcCommitScene)
FUNCTION(rtcNewGeometry)
FUNCTION(rtcReleaseGeometry)
FUNCTION(rtcSetNewGeometryBuffer)
FUNCTION(rtcSetGeometryBuildQuality)
FUNCTION(rtcCommitGeometry)
FUNCTION(rtcAttachGeometry)
FUNCTION(rtcIntersect1)
FUNCTION(rtcOccluded1)
FUNCTION(rtcOccluded8)
