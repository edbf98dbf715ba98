// SPDX-License-Identifier: GPL-3.0-or-later
//
// Traces bundles: combines the directions of a bake with the projector that finds the exchanges.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "bundles/directions.h"
#include "bundles/projector.h"
#include "patches/clusters.h"

namespace raybundle {

// A bundle and its lines.
struct TracedBundle {
    Bundle bundle;
    BundleLines lines;
};

// Traces the bundles of a sequence of directions.
class BundleTracer {
  public:
    // `clusters` are clusters of the patches; the lines then join sides of clusters instead of
    // sides of patches. Null if there are none. The clusters, and the objects that `input` refers
    // to, must outlive the tracer.
    BundleTracer(ProjectorKind projector, const ProjectorInput& input, DirectionKind directions,
                 uint32_t seed, const Clusters* clusters = nullptr);

    // Traces the next `count` bundles in parallel. `count` must be even (see Directions::next).
    std::vector<TracedBundle> trace(uint32_t count);

    // Reports to the directions the power that a bundle transported, W.
    void learn(const Bundle& bundle, double power) { directions.learn(bundle, power); }

    uint32_t bundleCount() const { return bundles; }
    uint64_t lineCount() const { return lines; }  // lines that met the scene
    // Returns the number of sheets and single faces that were rasterised (BundleLines::drawn).
    uint64_t drawnCount() const { return drawn; }
    // Returns the share of all exchanges that join sides in the wrong order of depth (painters) or
    // through a surface (ROULETTE).
    double disorderedShare() const {
        return exchanges > 0 ? double(disordered) / double(exchanges) : 0;
    }
    // Number of cycles that Newell's order broke.
    uint64_t cycleCount() const { return cycles; }

    // Area of the scene's cross-section that a line stands for, m^2. A side of exitance B (W/m^2)
    // sends the power 2 * pixelArea * B / (number of all bundles) along each of its lines, W.
    double pixelArea;

  private:
    Directions directions;
    const Clusters* const clusters;
    tbb::enumerable_thread_specific<std::unique_ptr<Projector>> projectors;
    uint32_t bundles = 0;
    // Exchanges and disordered exchanges are counted line by line.
    uint64_t lines = 0, drawn = 0, exchanges = 0, disordered = 0, cycles = 0;
};

// Properties of each patch side, measured by lines of the exact projector.
struct Surroundings {
    std::vector<float> exposed;  // per side: share of its area that touches no other surface
    // Per side: share of the lines from the exposed part that leave the scene.
    std::vector<float> open;
};

// Measures the surroundings of all sides by some bundles with the pixel size of `input`. A side
// that no line meets counts as exposed and not open.
Surroundings surroundings(const ProjectorInput& input, uint32_t seed);

}  // namespace raybundle
