// SPDX-License-Identifier: GPL-3.0-or-later
//
// Work that a bake leaves out if the scene does not need it. The setting "skip.NAME" switches each
// skip off, to test that the result stays equal and to measure what the skip saves. All skips are
// on by default. job/setting_table.h states what each leaves out, and when.
#pragma once

namespace raybundle {

// Switches of the skips: 1 leaves the work out if possible, 0 always does it.
struct Skips {
    // Skips that are proofs: they change the result only by rounding.
    int skipDarkness = 1;
    int skipReflection = 1;
    int skipGeometry = 1;
    int skipLights = 1;
    int skipFacing = 1;
    int skipSheets = 1;
    int skipOccluders = 1;
    int skipLampInsides = 1;
    // Skips that change the result by less than the stated error.
    int skipLit = 1;
    int skipWeak = 1;
    int skipInside = 1;
    int skipClusters = 1;
    int skipGather = 1;
    int skipBundles = 1;
    int skipWarmStart = 1;
};

}  // namespace raybundle
