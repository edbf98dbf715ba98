// SPDX-License-Identifier: GPL-3.0-or-later
//
// The noise: how far the light on the patch sides is from that of infinitely many bundles and
// shadow rays on the same patches. Light is shown interpolated over the cells of the user's faces,
// so that what differs from patch to patch within a cell is not seen: that of the cells' means
// foretells the noise at corners (stated_error/object_noise.h).
//
// Source: thesis section 4.3.3 (stated error).
// Differs:
// - Two independent halves of the bundles instead of repeated runs: half their difference, joined
//   with the standard error of the first shot.
// - The difference of two halves is one sample of few degrees of freedom: bundles err alike on
//   whole walls. So each look at the halves is averaged with those before, brought to the same
//   number of bundles; and as long as there are few looks a factor makes up for the chance that
//   the difference is small, which a stop at the first look that meets the target prefers.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "bundles/directions.h"
#include "transport/set_light.h"

namespace raybundle {

// What the looks at the halves of some lines have told, for the next bake with the same lines.
struct Looks {
    uint32_t count = 0, bundles = 0;
    double share = 1;  // of the last look's squares that counts, by the looks before it
    std::vector<double> shareOfParts{};  // likewise, see NoisyParts; empty: not known
};

class Noise {
  public:
    // before: of earlier bakes with these lines. weight: per side of tiles, exposed area in m^2
    // where the light is a result, else 0. directError: per side, standard error of the first shot,
    // W/m^2, independent of that of others. cellOf: per side, the cell that shows it. All must
    // outlive the object.
    Noise(const Looks& before, const std::vector<float>& weight,
          const std::vector<float>& directError, const std::vector<uint32_t>& cellOf);

    // A look at the halves of so many bundles.
    void look(const std::array<Irradiance, 2>& half, uint32_t bundles, double bias);
    // Of the same bundles, after what else has made the halves better.
    void lookAgain(const std::array<Irradiance, 2>& half);

    // On the sides, as of the last look, relative to the RMS of the light.
    double relative() const;
    // What both halves are off alike, by Transport::bias; relative.
    double biasOfBoth() const { return bias; }
    // So many times too large is the noise of bundles for a relative target beside that of the
    // first shot, which they do not help: beside that of the cells' means, where the target is out
    // of reach on the sides.
    double excess(double target) const;
    Looks looks() const;
    // So many times the last look's squares are the noise of bundles, by the looks before it too.
    double scale() const;
    // Per side: half the difference of the halves, brought to the stated size, W/m^2.
    std::vector<glm::vec3> perSide() const;
    // Of one side of a cell, of the last look: the noise of bundles in its mean, what of that is
    // because patches differ at random, that of the first shot, and the light; squares summed over
    // RGB, (W/m^2)^2.
    struct OfCell {
        double area = 0;  // exposed, m^2; 0: it has no result
        double noise = 0, random = 0, direct = 0, light = 0;
    };
    // Two a cell.
    const std::vector<OfCell>& cells() const { return ofCells; }

  private:
    void measure(const std::array<Irradiance, 2>& half);
    // Of bundles alone, on the sides, relative.
    double ofBundles() const;
    double factor() const;

    const std::vector<float>& weight;
    const std::vector<float>& directError;
    const std::vector<uint32_t>& cellOf;

    std::vector<glm::vec3> difference;  // per side: half that of the halves, W/m^2
    std::vector<OfCell> ofCells;
    double bundleNoise = 0;  // relative squares, of the last look
    double pooled = 0;       // the same, averaged with the looks before
    double directNoise = 0, bias = 0, signal = 0;
    double directOfCells = 0;  // relative square, of the cells' means
    uint32_t bundles = 0, looked = 0;
    Looks before;
};

// Per side.
struct SideNoise {
    explicit SideNoise(size_t sides) : ofBundles(sides, glm::vec3(0.0f)), direct(sides, 0.0f) {}

    std::vector<glm::vec3> ofBundles;  // a sample of it, see Noise::perSide, W/m^2
    std::vector<float> direct;         // standard error of the first shot, W/m^2
    std::vector<double> ofObjects;     // per instance: see noiseAtCorners; empty: there is no light
    // Whether rays have left more than the target, since more bundles gain little on what they met.
    bool isOutOfReach = false;
};

// The noise of the light of all, and that of each light set.
class SetNoise {
  public:
    // As above. errorOfSets: of each set, standard error of the first shot per side, W/m^2. tiles:
    // whose sides these are. weight must outlive the object.
    SetNoise(const Looks& before, std::vector<std::vector<float>> errorOfSets,
             const std::vector<float>& weight, const Patches& tiles);
    SetNoise(const SetNoise&) = delete;

    // A look at the halves of all lights.
    void look(const std::vector<std::array<Irradiance, 2>>& halves, uint32_t bundles, double bias);

    // Of the same bundles, after what else has made the halves better.
    void lookAgain(const std::vector<std::array<Irradiance, 2>>& halves);

    // As of the last look, relative: of the light of all, then of each light set.
    std::vector<double> relative() const;
    // The largest of theirs, see Noise::excess.
    double excess(double target) const;
    // Of the light of all.
    Looks looks() const { return noises.front().looks(); }
    SideNoise perSide() const;
    // Of the light of all, then of each light set.
    const std::vector<Noise>& ofLights() const { return noises; }

  private:
    template <class Look>
    void lookAtAll(const std::vector<std::array<Irradiance, 2>>& halves, const Look& look);

    const std::vector<std::vector<float>> errorOfSets;
    const std::vector<uint32_t> cellOf;
    std::vector<float> directError;  // of the light of all, per side, W/m^2
    std::vector<Noise> noises;
};

}  // namespace raybundle
