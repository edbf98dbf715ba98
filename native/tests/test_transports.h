// SPDX-License-Identifier: GPL-3.0-or-later
//
// Transports without the other stages of a bake, for comparison, and means over seeds.
#pragma once

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "transport/transport.h"

namespace raybundle::test {

// The input of a transport without a first shot: all emission is left to the transport.
struct TransportScene {
    TransportScene(const Scene& scene, float patchSize, float pixelSize);

    // Makes a transport with its own bundles and random numbers.
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

// Exitance in the cube with one patch per face, reflectance 0.5 and an exitance of 1 W/m^2 emitted
// by face 0: of face 0, of the opposite face, and of each of the four faces between, W/m^2.
constexpr double kCubeExitance[] = {1.0909090981, 0.1817458261, 0.1818362689};
// Returns the exitance of the three kinds of faces for given direct irradiances on them, W/m^2.
std::array<double, 3> cubeExitance(const std::array<double, 3>& direct);
// Returns the kind of face (0 to 2, as in kCubeExitance) of the front of a patch.
int cubeFace(const Patches& patches, uint32_t patch);

// The exitance of the three kinds of faces, as found by transports with many seeds.
class CubeExitance {
  public:
    // Adds the exitance that follows from a first shot and the light found by a transport.
    void add(const Patches& patches, const FirstShot& shot, const Irradiance& light);

    // Expects the means to be within three standard errors of kCubeExitance, and the standard
    // errors to be small. With 200 random seeds one comparison in 370 would fail by chance; the
    // seeds are fixed. `what` is named in messages.
    void expectExact(const std::string& what) const;

  private:
    std::array<Statistics, 3> faces;
};

// Bakes the cube with `seeds` seeds and expects the mean over them to be within three standard
// errors of the exact exitance. The emission is bright enough to be gathered, so that the transport
// starts from gathered light.
void expectExactOnBakedCube(const Settings& settings, int seeds);

// Returns the relative RMS difference of the irradiance on the fronts, weighted by area.
double frontNoise(const Patches& patches, const Irradiance& a, const Irradiance& b);

}  // namespace raybundle::test
