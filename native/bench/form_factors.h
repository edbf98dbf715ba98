// SPDX-License-Identifier: GPL-3.0-or-later
//
// Estimators of a form factor between two patch sides: the thesis' three kinds of local lines, and
// global lines. For tests and benchmarks; no bake uses a form factor by itself.
//
// Sources: thesis section 2.3.1, eq. 2.26 (area), 2.27 (hemisphere), 2.28 (cosine); section 2.3.2,
// eq. 2.30 (global lines, F = r_ij / r_i).
// Differs: lines that leave the scene count in r_i.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "patches/patches.h"
#include "visibility/visibility.h"

namespace raybundle {

// A pair of sides in a scene. References must outlive it.
struct FormFactor {
    const Patches& patches;
    const Visibility& visibility;
    uint32_t from, to;
};

// Each an estimate by `lines` lines.
// Pairs of points, uniform on both sides.
double formFactorByArea(const FormFactor& f, uint32_t lines, std::mt19937_64& random);
// Lines from uniform points on one, their polar angle and azimuth uniform.
double formFactorByHemisphere(const FormFactor& f, uint32_t lines, std::mt19937_64& random);
// The same, distributed by the cosine: the share that meets the other side.
double formFactorByCosine(const FormFactor& f, uint32_t lines, std::mt19937_64& random);
// Global lines, through pairs of uniform points on the scene's bounding sphere. Only those that
// meet `from` tell something: 0 if there is none.
double formFactorByGlobalLines(const FormFactor& f, uint32_t lines, std::mt19937_64& random);
// Bundles of parallel lines, random directions: about `lines` through the bounding sphere in all,
// in `bundles` bundles (even).
double formFactorByBundles(const FormFactor& f, uint32_t lines, uint32_t bundles,
                           std::mt19937_64& random);

struct FormFactorEstimator {
    std::string name;
    double (*estimate)(const FormFactor& f, uint32_t lines, std::mt19937_64& random);
};
// All of them; of the bundles, with 100 lines each.
const std::vector<FormFactorEstimator>& formFactorEstimators();

}  // namespace raybundle
