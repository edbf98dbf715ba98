// SPDX-License-Identifier: GPL-3.0-or-later
//
// Noise where it is seen: the noise of the bundles on each part of each object, relative to the
// light there. It determines when there are enough bundles, and where local rays take less time
// than more bundles would (transport/extra_rays.h).
//
// Source: none; the thesis judges the whole scene (section 4.3.3).
// - Half the difference of the halves at the corners of a cell is one sample of its noise. The
//   samples of all cells of a part are averaged. What the noise of the whole object predicts for
//   the part, and the earlier looks, count a little too.
// - A bundle takes time for each of its lines, wherever they go, and for each face in its windows.
//   As long as the parts that need more lines get so large a share of the lines that rays would
//   take longer, another bundle is cheaper.
// - Rays are cast in passes. The noise that a pass leaves on an object is visible in the halves,
//   and decides about the next pass.
#pragma once

#include <cstdint>
#include <vector>

#include "patches/tiles.h"
#include "reconstruction/shown_light.h"
#include "stated_error/noise.h"
#include "stated_error/object_noise.h"
#include "transport/extra_rays.h"

namespace raybundle {

// The input of NoisyParts. References must outlive this struct.
struct NoisyPartsInput {
    const Scene& scene;
    const Tiles& tiles;
    const Looks& before;  // of earlier bakes with these lines
    // Per side of the tiles: exposed area of sides with a result, otherwise 0, m^2.
    const std::vector<float>& weight;
    // Rays do not help where corners gather instead of showing the light of their side.
    const ShownLight& shown;
    const std::vector<double>& growth;  // per instance, see cornerGrowth()
    const ShownNoise& shownNoise;       // of the halves of the last look
    const double target;                // relative
};

// The noise of the parts of all objects with a result. A part is a piece of an object that faces
// one way (patches/parts.h).
class NoisyParts {
  public:
    // Finds the parts. `tiles`, `growth` and `shownNoise` of the input must outlive the object.
    explicit NoisyParts(const NoisyPartsInput& input);

    // Takes over the last look of `noise` after `bundles` bundles. `lines` is per side of the tiles
    // the number of lines that have met it, and `all` the number of lines over all sides, including
    // sides that are not shown. `faces` is the number of faces that bundles have looked at and
    // drawn for these lines, as far as it counts.
    void look(const SetNoise& noise, uint32_t bundles, const std::vector<float>& lines, double all,
              double faces);

    // Returns per part the value of Looks::shareOfParts for the next bake with these lines.
    std::vector<double> shares() const;
    // Returns the ratio to the target of the noise at corners on the parts where further bundles
    // are the cheapest remedy. Parts that rays clean in less time do not count.
    double excess() const;
    // Returns the rays for each side of the patches that has too few samples for the target. Only
    // the last look counts, so that the same light always gets the same rays, whatever was baked
    // before. `samples` is per side and half the number of lines that have met the side, plus its
    // earlier rays in units of lines. `most` is the largest number of rays per side.
    std::vector<ExtraRays> rays(const std::vector<std::array<float, 2>>& samples,
                                uint32_t most) const;
    // Takes over a look of `noise` at halves that include the rays cast so far. A part above the
    // target is to get more rays if the rays have reduced the noise of its object enough, and if
    // `furtherPasses` passes, each with twice as many rays, can clean the object. Returns the ratio
    // of the remaining noise to the target, for the object where it is largest; the noise of an
    // object is its quantile over nine tenths of its parts. The remaining noise is that of the
    // rays, and that of the light that they met.
    double lookWithRays(const SetNoise& noise, uint32_t furtherPasses);

  private:
    // A part of an object.
    struct Part {
        uint32_t instance = 0;
        bool isGathered = false;         // see ShownLight::isGathered
        bool isGatheredAtNodes = false;  // see ShownLight::isGatheredAtNodes
        double strictness = 1;           // factor on its squared noise: that of the object's target
        // Sides, and lines that have met them.
        double sides = 0, lines = 0;
        // Squared noise at the corners divided by the squared light there: at the last look, and
        // averaged with the earlier looks.
        double last = 0, squares = 0;
        // Whether more rays are worth their time, and the factor on the number of samples that the
        // last look predicts to be needed.
        bool wantsRays = true;
        double wanting = 1;
    };
    // One side of a cell with a result.
    struct SeenCell {
        uint32_t number;  // index in Noise::cells()
        uint32_t part, island;
        double area;  // of the whole cell, covered parts included, m^2
    };
    // The squared noise at corners relative to the light there, as measured (ShownNoise).
    struct Measured {
        // Per part: the mean over the exposed area of its cells, so that splitting a face changes
        // nothing; and the number of these cells, each counted with the share of it that is
        // exposed.
        std::vector<double> squares, cells;
        // Per instance: the ratio of the squares to the prediction of bundlesAtCorners(). Unlike
        // ShownNoise::overForetold, which states the noise of the object as a whole, it is relative
        // to the light of each cell, and no single cell decides it.
        std::vector<double> overForetold;
    };
    // Returns per cell the squared light that its noise is relative to, (W/m^2)^2. It is 0 where
    // the cell has no exposed area, or where there is no light.
    std::vector<double> lightOf(const Noise& noise) const;
    // Returns the measured noise of all light. `light` is the result of lightOf() for `noise`.
    Measured measure(const Noise& noise, const std::vector<double>& light) const;
    // Returns per part the squared relative noise at the corners, as bundlesAtCorners() predicts
    // it, with the ratio that was measured on the object. Parts whose corners gather get the value
    // of their whole object. `light` is the result of lightOf() for `noise`.
    std::vector<double> foretold(const Noise& noise, const std::vector<double>& light,
                                 const Measured& measured) const;
    // Returns per part the squared relative noise at the corners, the largest of all lights, as if
    // the objects had the target of the scene.
    std::vector<double> squaresOf(const SetNoise& noise) const;
    // Returns per instance the quantile over nine tenths of its parts, or of those parts that want
    // rays. `squares` is per part.
    std::vector<double> squaresOfObjects(const std::vector<double>& squares,
                                         bool onlyWantingRays) const;

    const Tiles& tiles;
    const Looks before;
    std::vector<uint32_t> partOf;  // per side of the tiles; kNone without a result
    std::vector<SeenCell> cells;   // with a result
    std::vector<Part> parts;
    const std::vector<double>& growth;
    const ShownNoise& shownNoise;
    // Per instance: squared relative noise with the rays cast so far, over the parts that want more
    // rays, see squaresOfObjects().
    std::vector<double> ofObjects;
    const double target;
    // At the last look: the numbers of lines over all sides, of faces and of bundles.
    double allLines = 0, allFaces = 0;
    uint32_t bundles = 0;
};

}  // namespace raybundle
