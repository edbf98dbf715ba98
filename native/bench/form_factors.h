// SPDX-License-Identifier: GPL-3.0-or-later
//
// Estimators of the form factor between two patch sides: by the thesis' three kinds of local lines,
// and by global lines. They serve tests and benchmarks; no bake uses a single form factor.
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

// A pair of patch sides in a scene. The references must outlive it.
struct FormFactor {
    const Patches& patches;
    const Visibility& visibility;
    uint32_t from, to;
};

// Each of these functions estimates the form factor F_from,to with `lines` lines.
// By area: lines between pairs of points, uniform on both sides.
double formFactorByArea(const FormFactor& f, uint32_t lines, std::mt19937_64& random);
// By hemisphere: lines from uniform points on `from`, with a uniform polar angle and azimuth.
double formFactorByHemisphere(const FormFactor& f, uint32_t lines, std::mt19937_64& random);
// By cosine: lines from uniform points on `from`, distributed by the cosine. The result is the
// share of lines that meet `to`.
double formFactorByCosine(const FormFactor& f, uint32_t lines, std::mt19937_64& random);
// By global lines through pairs of uniform points on the scene's bounding sphere. Only lines that
// meet `from` contribute; the result is 0 if no line does.
double formFactorByGlobalLines(const FormFactor& f, uint32_t lines, std::mt19937_64& random);
// By bundles of parallel lines with random directions: about `lines` lines through the bounding
// sphere in all, in `bundles` bundles (an even number).
double formFactorByBundles(const FormFactor& f, uint32_t lines, uint32_t bundles,
                           std::mt19937_64& random);

// An estimator with its name.
struct FormFactorEstimator {
    std::string name;
    double (*estimate)(const FormFactor& f, uint32_t lines, std::mt19937_64& random);
};
// Returns all estimators. The bundles have 100 lines each.
const std::vector<FormFactorEstimator>& formFactorEstimators();

}  // namespace raybundle
