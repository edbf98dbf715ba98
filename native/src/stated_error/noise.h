// SPDX-License-Identifier: GPL-3.0-or-later
//
// Noise: the random error of the light on patch sides, compared with the light of infinitely many
// bundles and shadow rays on the same patches. The result is interpolated over the cells of the
// user's faces, so that noise which differs from patch to patch within a cell is not seen. The
// noise at corners is therefore predicted from the noise of the means over cells
// (stated_error/object_noise.h).
//
// Source: thesis section 4.3.3 (stated error).
// Differs:
// - The bundles form two independent halves, where the thesis repeats the whole run. Half the
//   difference of the halves is combined with the standard error of the first shot.
// - The difference of two halves is one sample with few degrees of freedom, because the errors of
//   bundles are correlated over whole walls. Each look at the halves is therefore averaged with the
//   earlier looks, scaled to the same number of bundles. A bake that stops at the first look below
//   the target would prefer looks whose difference is small by chance. A factor compensates for
//   this while there are few looks.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "bundles/directions.h"
#include "patches/patches.h"

namespace raybundle {

// An estimate of the light by each half of the bundles: direct and indirect irradiance together, per
// side of the patches or of the tiles, W/m^2.
using LightOfHalves = std::array<std::vector<glm::vec3>, 2>;

// The sides of the tiles, ordered by the side of a cell that shows their light. Sides of cells are
// numbered 2 * cell for fronts and 2 * cell + 1 for backs.
struct SidesOfCells {
    explicit SidesOfCells(const Patches& tiles);

    size_t count() const { return first.size() - 1; }

    std::vector<uint32_t> sides;
    // Per side of a cell: the index in `sides` of its first side. One more entry at the end.
    std::vector<uint32_t> first;
};

// What all looks at the halves of a set of lines have found, for the next bake with the same lines.
struct Looks {
    // Number of looks, and number of bundles at the last look.
    uint32_t count = 0, bundles = 0;
    // Ratio of the squared noise that was averaged over all looks to that of the last look.
    double share = 1;
    // The same ratio for each part of NoisyParts. Empty if not known.
    std::vector<double> shareOfParts{};
};

// The noise of the light of one light set, or of all light. "Noise of bundles" is that from
// finitely many bundles; "relative" is relative to the RMS of the light.
class Noise {
  public:
    // Prepares the measurement. `before` holds the looks of earlier bakes with these lines. The
    // other arguments are per side of the tiles. `weight` is the exposed area of sides with a
    // result, otherwise 0, m^2. `directError` is the standard error of the first shot, W/m^2,
    // independent between sides. The last three must outlive the object.
    Noise(const Looks& before, const std::vector<float>& weight,
          const std::vector<float>& directError, const SidesOfCells& cells);

    // Measures the noise from the two halves (per side of the tiles) after `bundles` bundles.
    // `bias` is the relative error that both halves share, see Transport::bias().
    void look(const LightOfHalves& half, uint32_t bundles, double bias);
    // Measures again with the same bundles, after other work (extra rays) has improved the halves.
    void lookAgain(const LightOfHalves& half);

    // Returns the noise of bundles and first shot on the sides at the last look, relative.
    double relative() const;
    // Returns the relative error that both halves share, as given to look().
    double biasOfBoth() const { return bias; }
    // Returns the ratio of the noise of bundles to the noise that the relative `target` leaves for
    // bundles. Bundles do not reduce the noise of the first shot, which is therefore subtracted
    // from the target. If the first shot alone nearly exceeds the target on the sides, its noise in
    // the means over cells is subtracted instead.
    double excess(double target) const;
    // Returns what the looks have found, for the next bake with these lines.
    Looks looks() const;
    // Returns the ratio of the stated squared noise of bundles, averaged over all looks, to that of
    // the last look alone.
    double scale() const;
    // Returns a sample of the noise of bundles per side: half the difference of the halves, scaled
    // to the stated noise, W/m^2.
    std::vector<glm::vec3> perSide() const;
    // The noise in the mean over one side of a cell at the last look. All but `area` are squares,
    // summed over RGB, (W/m^2)^2: `noise` of bundles; `random`, the part of it that is caused by
    // random differences between patches; `direct`, of the first shot; `light`, the light itself.
    struct OfCell {
        double area = 0;  // exposed area with a result, m^2; 0 if there is none
        double noise = 0, random = 0, direct = 0, light = 0;
    };
    // Returns the noise of the cells, numbered as in SidesOfCells.
    const std::vector<OfCell>& cells() const { return ofCells; }

  private:
    // Sets all members that depend on the last look alone.
    void measure(const LightOfHalves& half);
    // Returns the relative noise of bundles on the sides, with the error that both halves share.
    double ofBundles() const;
    // Returns the factor by which the noise is increased while there are few looks.
    double factor() const;

    const std::vector<float>& weight;
    const std::vector<float>& directError;
    const SidesOfCells& sidesOf;

    std::vector<glm::vec3> difference;  // per side: half the difference of the halves, W/m^2
    std::vector<OfCell> ofCells;
    double bundleNoise = 0;  // relative square, of the last look
    double pooled = 0;       // relative square, averaged over all looks
    // Relative square of the first shot's noise on the sides; relative shared error; sum over the
    // sides of the weight times the squared light, (W/m^2)^2 m^2.
    double directNoise = 0, bias = 0, signal = 0;
    double directOfCells = 0;  // relative square of the first shot's noise in the means over cells
    // At the last look; and the number of looks, those of earlier bakes included.
    uint32_t bundles = 0, looked = 0;
    Looks before;
};

// The noise per side of the tiles, and what the bake derived from it.
struct SideNoise {
    explicit SideNoise(size_t sides) : ofBundles(sides, glm::vec3(0.0f)), direct(sides, 0.0f) {}

    std::vector<glm::vec3> ofBundles;  // a sample of it, see Noise::perSide(), W/m^2
    std::vector<float> direct;         // standard error of the first shot, W/m^2
    // Relative, per instance, see noiseAtCorners(). Empty if there is no light.
    std::vector<double> ofObjects;
    // Whether extra rays have left more noise than the target. This noise lies in the light of the
    // surfaces that the rays met, and further bundles would reduce it only a little.
    bool isOutOfReach = false;
};

// The noise of the light of all sources, and of the light of each light set.
class SetNoise {
  public:
    // Prepares the measurement. See Noise for `before` and `weight`. `errorOfSets` is, per entry of
    // SetLights, the standard error of the first shot per side of the tiles, W/m^2. `weight` and
    // `cells` must outlive the object.
    SetNoise(const Looks& before, std::vector<std::vector<float>> errorOfSets,
             const std::vector<float>& weight, const SidesOfCells& cells);
    SetNoise(const SetNoise&) = delete;

    // Measures the noise of all lights. `halves` is per entry of SetLights. For the other arguments
    // see Noise::look().
    void look(const std::vector<LightOfHalves>& halves, uint32_t bundles, double bias);

    // Measures again with the same bundles, after other work (extra rays) has improved the halves.
    void lookAgain(const std::vector<LightOfHalves>& halves);

    // Returns the relative noise at the last look, of the light of all sources and then of each
    // light set.
    std::vector<double> relative() const;
    // Returns the largest Noise::excess() of all lights.
    double excess(double target) const;
    // Returns the looks at the light of all sources.
    Looks looks() const { return noises.front().looks(); }
    // Returns the noise of the light of all sources per side. The noise of objects is not set.
    SideNoise perSide() const;
    // Returns the noise of the light of all sources, and then of each light set.
    const std::vector<Noise>& ofLights() const { return noises; }

  private:
    // Calls look(noise, halves) for the light of each light set, and then for the light of all
    // sources.
    template <class Look>
    void lookAtAll(const std::vector<LightOfHalves>& halves, const Look& look);

    const std::vector<std::vector<float>> errorOfSets;
    std::vector<float> directError;  // of the light of all sources, per side, W/m^2
    std::vector<Noise> noises;
};

}  // namespace raybundle
