/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A library with the names of Embree's functions, as another version of it would be: whoever calls
 * one of them ends. To be loaded before the library under test. */
#include <stdio.h>
#include <stdlib.h>

static void end(const char* name) {
    fprintf(stderr, "another Embree was called: %s\n", name);
    abort();
}

#define FUNCTION(name)  \
    void name(void);    \
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
FUNCTION(rtcCommitScene)
FUNCTION(rtcNewGeometry)
FUNCTION(rtcReleaseGeometry)
FUNCTION(rtcSetNewGeometryBuffer)
FUNCTION(rtcCommitGeometry)
FUNCTION(rtcAttachGeometry)
FUNCTION(rtcIntersect1)
FUNCTION(rtcOccluded1)
FUNCTION(rtcOccluded8)
