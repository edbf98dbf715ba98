// SPDX-License-Identifier: GPL-3.0-or-later
//
// Work that a bake leaves out where the scene does not need it. Each skip can be switched off by
// the setting "skip.NAME", to test that the result stays the same and to measure what it saves; all
// are on by default.
#pragma once

namespace raybundle {

struct Skips {
    // Proofs: the result is the same to rounding.
    int skipDarkness = 1;     // bundles and solve, if no light reaches any surface
    int skipReflection = 1;   // the same, if no surface reflects and lines carry nothing else
    int skipGeometry = 1;     // patches and lines, if geometry is as in the last bake
    int skipLights = 1;       // the first shot, if lights too are as in the last bake
    int skipFacing = 1;       // shadow rays to a source that the receiver cannot face
    int skipSheets = 1;       // projection of faces that lie in a plane with others of their kind
    int skipOccluders = 1;    // reconstruction of objects that only occlude
    int skipLampInsides = 1;  // emission inside of closed surfaces with nothing else in them
    // Within the stated error.
    int skipLit = 1;        // noise of a source wholly visible: its closed form
    int skipWeak = 1;       // most shadow rays to a source that gives little of the light
    int skipInside = 1;     // most shadow rays from the inside of solids
    int skipClusters = 1;   // light of each patch, where it is not shown and finer than tiles
    int skipGather = 1;     // final gather, where interpolation follows the light
    int skipBundles = 1;    // bundles once the noise is at its target
    int skipWarmStart = 1;  // iterations that a solve from zero takes more than one from the last
};

}  // namespace raybundle
