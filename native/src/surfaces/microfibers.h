// SPDX-License-Identifier: GPL-3.0-or-later
//
// Upright fibres on a surface: how much light they send towards an angle, and where that comes
// from.
//
// Source: Zeltner, Burley and Chiang, "Practical Multiple-Scattering Sheen Using Linearly
// Transformed Cosines" (2022), Cycles' sheen from Blender 4.0 on. Heitz et al., "Real-Time
// Polygonal-Light Shading with Linearly Transformed Cosines" (2016).
// Differs: the table is what Cycles (4.5) shows of a sheet of sheen under suns from 48 directions,
// which the formula fits to 1e-4, in larger steps: of the light from one direction 0.5 % goes
// elsewhere at most, RMS over the directions.
#pragma once

namespace raybundle {

struct Microfibers {
    float albedo;  // of light from everywhere, towards the angle
    float a, b;    // of the transform: of the light's frame below into that of a cosine

    // roughness: 0 to 1, as 0.2 below it. cosine: of the angle towards which the light goes.
    static Microfibers at(float roughness, float cosine);

    // Exitance towards the angle over irradiance. x, z: of a unit vector to the light, along the
    // way the light goes, on the surface, and along the normal.
    float towards(float x, float z) const {
        const float along = a * x + b * z, y2 = 1 - x * x - z * z;
        const float square = along * along + a * a * (y2 > 0 ? y2 : 0) + z * z;
        return albedo * a * a / (square * square);
    }
};

}  // namespace raybundle
