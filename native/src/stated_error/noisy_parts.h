// SPDX-License-Identifier: GPL-3.0-or-later
//
// Noise where it is seen: that of the bundles on each part of each object, relative to the light
// there. It tells when there are enough bundles, and where local rays of their own take less time
// than more bundles would (transport/extra_rays.h).
//
// Source: none; the thesis judges the whole scene (section 4.3.3).
// - Half the difference of the halves at a cell is one sample of its noise. Those of a part are
//   pooled, those of its object count a little too, and what the looks before have told.
// - A bundle takes time for each line, wherever that goes, and for each face in its windows. While
//   the parts that need more of them get so many of the lines that rays would take longer, another
//   bundle is cheaper.
// - Rays come in passes. What a pass leaves on an object is seen in its halves; each sees what
//   those before have brought.
#pragma once

#include <cstdint>
#include <vector>

#include "patches/tiles.h"
#include "reconstruction/shown_light.h"
#include "stated_error/noise.h"
#include "transport/extra_rays.h"

namespace raybundle {

// What NoisyParts are made of. References must outlive it.
struct NoisyPartsInput {
    const Tiles& tiles;
    const Looks& before;               // of earlier bakes with these lines
    const std::vector<float>& weight;  // per side of the tiles, positive where it has a result
    // Where corners gather instead of showing their side's light, rays do not help.
    const ShownLight& shown;
    // Per instance, see stated_error/object_noise.h; the second as of the halves that are looked
    // at.
    const std::vector<double>& growth;
    const std::vector<double>& shownOverForetold;
    // Of sheets and single faces, of each bundle, where there are windows of finer lines; else 0.
    const double projections;
    const double target;  // relative
};

class NoisyParts {
  public:
    // The tiles, growth and shownOverForetold must outlive the object.
    explicit NoisyParts(const NoisyPartsInput& input);

    // As of the last look of all lights. lines: per side of the tiles, how many have met it; all:
    // those of all sides, not shown ones included.
    void look(const SetNoise& noise, uint32_t bundles, const std::vector<float>& lines, double all);

    // See Looks::shareOfParts.
    std::vector<double> shares() const;
    // So many times too large for the target is the noise at corners where more bundles are
    // the cheapest remedy.
    double excess() const;
    // For each side of the patches that has too few samples for the target: rays. By the last look
    // alone: the same light has the same ones, whatever was baked before. samples: per side and
    // half, how many lines have met it, and rays by what they tell. most: of a side.
    std::vector<ExtraRays> rays(const std::vector<std::array<float, 2>>& samples,
                                uint32_t most) const;
    // As of a look at the halves with these rays: parts that are not clean yet are to have more if
    // that has made those of their object cleaner, and furtherPasses of twice as many each may
    // clean them. Returns how many times too large is what is left, on the object where that is
    // most: of nine parts of ten of it. It is the noise of the light that rays met, and their own.
    double lookWithRays(const SetNoise& noise, uint32_t furtherPasses);

  private:
    struct Part {
        uint32_t instance = 0;
        bool isGathered = false;
        double sides = 0, lines = 0;
        // Squares of the noise at corners over the light there: by the last look, and pooled with
        // those before.
        double last = 0, squares = 0;
        // Whether rays are worth their time; so many times the samples that the last look foretells
        // are to be had.
        bool wantsRays = true;
        double wanting = 1;
    };
    struct SeenCell {
        uint32_t number;  // two a cell, as Noise has them
        uint32_t part, island;
        double area;  // m^2, with what is covered
    };
    // Squares over the light of one noise, per part.
    std::vector<double> squaresOf(const Noise& noise) const;
    std::vector<double> squaresOf(const SetNoise& noise) const;  // the largest of all lights
    // Per instance: of nine parts of ten, of it or of those of it that want rays. squares: per
    // part.
    std::vector<double> squaresOfObjects(const std::vector<double>& squares,
                                         bool onlyWantingRays) const;

    const Tiles& tiles;
    const Looks before;
    std::vector<uint32_t> partOf;  // per side of the tiles; kNone: has no result
    std::vector<SeenCell> cells;   // of those with a result
    std::vector<Part> parts;
    const std::vector<double>& growth;
    const std::vector<double>& shownOverForetold;
    // Per instance, with the rays there are: of the parts that want more, see squaresOfObjects.
    std::vector<double> ofObjects;
    const double projections, target;
    double allLines = 0;
    uint32_t bundles = 0;
};

}  // namespace raybundle
