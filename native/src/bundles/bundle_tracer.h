// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bundles, traced: the directions of a bake and the projector that finds their exchanges.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "bundles/directions.h"
#include "bundles/projector.h"
#include "patches/clusters.h"

namespace raybundle {

struct TracedBundle {
    Bundle bundle;
    BundleLines lines;
};

class BundleTracer {
  public:
    // clusters: of the patches, whose sides lines are to join; null: those of the patches
    // themselves. What `input` refers to and the clusters must outlive it.
    BundleTracer(ProjectorKind projector, const ProjectorInput& input, DirectionKind directions,
                 uint32_t seed, const Clusters* clusters = nullptr);

    // Traces the next `count` bundles (even; see Directions::next) in parallel.
    std::vector<TracedBundle> trace(uint32_t count);

    // Tells the directions how much power a bundle transported, W.
    void learn(const Bundle& bundle, double power) { directions.learn(bundle, power); }

    uint32_t bundleCount() const { return bundles; }
    uint64_t lineCount() const { return lines; }  // that met the scene
    // The share of all exchanges that join sides in a wrong order of depth (painters) or through a
    // surface (ROULETTE).
    double disorderedShare() const {
        return exchanges > 0 ? double(disordered) / double(exchanges) : 0;
    }
    uint64_t cycleCount() const { return cycles; }  // that Newell's order broke

    // Power per area and unit of exitance that one line carries each way is 2 * pixelArea / bundles
    // of all: the cross-section of the scene that a line stands for, m^2.
    double pixelArea;

  private:
    Directions directions;
    const Clusters* const clusters;
    tbb::enumerable_thread_specific<std::unique_ptr<Projector>> projectors;
    uint32_t bundles = 0;
    uint64_t lines = 0, exchanges = 0, disordered = 0, cycles = 0;  // exchanges: line by line
};

// What lines of exact projection meet on each side.
struct Surroundings {
    std::vector<float> exposed;  // per side: the share of it that lies against no other surface
    std::vector<float> open;  // per side: the share of the lines from the rest that leave the scene
};

// By some bundles, with `input`'s pixels; sides that no line met are exposed and not open.
Surroundings surroundings(const ProjectorInput& input, uint32_t seed);

}  // namespace raybundle
