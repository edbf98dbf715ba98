// SPDX-License-Identifier: GPL-3.0-or-later
//
// Transports by themselves, with light that a test may set side by side; and means over seeds.
#pragma once

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "transport/transport.h"

namespace raybundle::test {

// What a transport is made of, without a first shot: all emission is left to the transport.
struct TransportScene {
    TransportScene(const Scene& scene, float patchSize, float pixelSize);

    // A transport from here on, with bundles and random numbers of its own.
    std::unique_ptr<Transport> make(Solver solver, int seed);

    Patches patches;
    const Visibility visibility;
    FirstShot shot;
    glm::vec3 world{0.0f};       // W/(m^2 sr)
    std::vector<float> exposed;  // per side
    Settings settings;

  private:
    const ProjectorInput projector;
    LineCounts counts;
    std::unique_ptr<BundleTracer> tracer;
};

// Mean and variance of independent values.
class Statistics {
  public:
    void add(double value) {
        ++count;
        const double d = value - average;
        average += d / count;
        squares += d * (value - average);
    }
    double mean() const { return average; }
    double variance() const { return squares / (count - 1); }
    double standardError() const { return std::sqrt(variance() / count); }

  private:
    double count = 0, average = 0, squares = 0;
};

// The cube with one patch per face, reflectance 0.5 and an exitance of 1 emitted by face 0:
// exitance of that face, the opposite one, and the four between.
constexpr double kCubeExitance[] = {1.0909090981, 0.1817458261, 0.1818362689};
// The same for any irradiance of the three straight from the lamp.
std::array<double, 3> cubeExitance(const std::array<double, 3>& direct);
// Which of the three the front of a patch is.
int cubeFace(const Patches& patches, uint32_t patch);

// The exitance of those three faces, by transports with many seeds.
class CubeExitance {
  public:
    // What a transport has found of the light of a first shot.
    void add(const Patches& patches, const FirstShot& shot, const Irradiance& light);

    // Expects the means to be within three standard errors of kCubeExitance, and these to be small.
    // Of 200 seeds one comparison in 370 would fail by chance if the seeds were not always the
    // same. what: is named in messages.
    void expectExact(const std::string& what) const;

  private:
    std::array<Statistics, 3> faces;
};

// Bakes the cube with `seeds` seeds and expects the mean over them to be within three standard
// errors of the exact exitance. The lamp is bright enough to be gathered: the transport starts from
// what it lit.
void expectExactOnBakedCube(const Settings& settings, int seeds);

// Area-weighted relative RMS difference of the irradiance on the fronts.
double frontNoise(const Patches& patches, const Irradiance& a, const Irradiance& b);

}  // namespace raybundle::test
