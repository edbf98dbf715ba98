// SPDX-License-Identifier: GPL-3.0-or-later
//
// Work that a bake leaves out where the scene does not need it. Each skip can be switched off by
// the setting "skip.NAME", to test that the result stays the same and to measure what it saves; all
// are on by default. What each leaves out, and when, is said in job/setting_table.h.
#pragma once

namespace raybundle {

struct Skips {
    // Proofs: the result is the same to rounding.
    int skipDarkness = 1;
    int skipReflection = 1;
    int skipGeometry = 1;
    int skipLights = 1;
    int skipFacing = 1;
    int skipSheets = 1;
    int skipOccluders = 1;
    int skipLampInsides = 1;
    // Within the stated error.
    int skipLit = 1;
    int skipWeak = 1;
    int skipInside = 1;
    int skipClusters = 1;
    int skipGather = 1;
    int skipBundles = 1;
    int skipWarmStart = 1;
};

}  // namespace raybundle
