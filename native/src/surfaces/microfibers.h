// SPDX-License-Identifier: GPL-3.0-or-later
//
// Sheen of upright fibres on a surface: how much light it reflects towards an angle, and from which
// directions this light comes.
//
// Sources: Zeltner, Burley and Chiang, "Practical Multiple-Scattering Sheen Using Linearly
// Transformed Cosines" (2022), which is Cycles' sheen from Blender 4.0 on; Heitz et al., "Real-Time
// Polygonal-Light Shading with Linearly Transformed Cosines" (2016).
// Differs: the table was fitted to renders of a sheet of sheen in Cycles 4.5, under suns from 48
// directions, which the formula fits to 1e-4. Its steps are larger than those of Cycles. At most
// 0.5 % of the light from one direction is sent elsewhere, RMS over the directions.
#pragma once

namespace raybundle {

// The sheen towards one angle.
struct Microfibers {
    float albedo;  // reflectance towards the angle of light from all directions
    // The linear transform that takes directions to the light to a cosine distribution. In the
    // frame of towards(), it maps (x, y, z) to (a x + b z, a y, z).
    float a, b;

    // Returns the sheen of a roughness, 0 to 1 (less than 0.2 counts as 0.2), towards an angle
    // whose cosine to the normal is given.
    static Microfibers at(float roughness, float cosine);

    // Returns the exitance towards the angle divided by the irradiance (both for light from one
    // direction). x and z are coordinates of the unit vector to the light: z along the normal, and
    // x along the surface in the direction in which the light leaves.
    float towards(float x, float z) const {
        const float along = a * x + b * z, y2 = 1 - x * x - z * z;
        const float square = along * along + a * a * (y2 > 0 ? y2 : 0) + z * z;
        return albedo * a * a / (square * square);
    }
};

}  // namespace raybundle
