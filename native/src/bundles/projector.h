// SPDX-License-Identifier: GPL-3.0-or-later
//
// Projectors turn a bundle into exchanges. Each projector has its own file and a row of the table
// in projector.cpp. The inner loops belong to the projectors; only whole bundles pass through this
// interface.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "bundles/directions.h"
#include "bundles/line_windows.h"
#include "job/settings.h"
#include "patches/patches.h"
#include "visibility/visibility.h"

namespace raybundle {

// Two patch sides that face each other along `lines` lines of a bundle.
struct Exchange {
    uint32_t i, j;
    uint32_t lines;
};

// The lines of one bundle. Numbers of lines are integers even if a projector finds an exchange only
// with a probability p. The exchange then stands for 1 / p lines, rounded up or down at random
// without bias.
struct BundleLines {
    std::vector<Exchange> exchanges;  // a pair may occur several times
    // One entry per line that leaves the scene: the patch side that the line leaves.
    std::vector<uint32_t> sky;
    // Sides that touch another surface, one entry per line. These lines exchange nothing.
    std::vector<uint32_t> touching;
    // The lists above hold the lines of one density after those of another. Each entry gives the
    // number of finest lines that a line of this density stands for, and the ends of its ranges in
    // the lists. If `densities` is empty, each line stands for itself.
    struct Density {
        uint32_t weight;
        size_t exchanges, sky, touching;
    };
    std::vector<Density> densities;
    uint64_t lines = 0;  // number of lines that meet the scene
    // Number of sheets and single faces that were rasterised, once for each view (rasteriser.h).
    // Only FRAGMENT_LISTS counts them.
    uint64_t drawn = 0;
    // Number of exchanges in the wrong order of depth (painters) or through a solid (ROULETTE).
    uint64_t disordered = 0;
    uint64_t cycles = 0;  // number of broken cycles of patches that cover each other (Newell)

    // Calls visit(entry, weight) for all entries of a list. `weight` is the number of finest lines
    // that the entry's lines stand for.
    template <class Visit>
    void forEachExchange(const Visit& visit) const {
        forEach(exchanges, &Density::exchanges, visit);
    }
    template <class Visit>
    void forEachSky(const Visit& visit) const {
        forEach(sky, &Density::sky, visit);
    }
    template <class Visit>
    void forEachTouching(const Visit& visit) const {
        forEach(touching, &Density::touching, visit);
    }

    // Returns the memory of the lists in bytes.
    size_t byteCount() const {
        return exchanges.size() * sizeof(Exchange) +
               (sky.size() + touching.size()) * sizeof(uint32_t);
    }

  private:
    template <class Entry, class Visit>
    void forEach(const std::vector<Entry>& list, size_t Density::*end, const Visit& visit) const {
        if (densities.empty())
            for (const Entry& entry : list) visit(entry, 1u);
        size_t k = 0;
        for (const Density& density : densities)
            for (; k < density.*end; ++k) visit(list[k], density.weight);
    }
};

// Interface of all projectors.
class Projector {
  public:
    virtual ~Projector() = default;

    // Projects the scene along a bundle and appends the lines to `out`.
    virtual void project(const Bundle& bundle, BundleLines& out) = 0;
};

// Arguments of the projectors' constructors. The referenced objects must outlive the projectors.
struct ProjectorInput {
    const Patches& patches;
    const Visibility& visibility;
    float pixelSize;  // edge of a pixel in metres, equal for all bundles
    SmallPatches smallPatches = SmallPatches::CENTRE_SAMPLING;
    int planeCount = 4;  // number of planes per bundle, for PLANES
    PlanePlacement planePlacement = PlanePlacement::SYSTEMATIC;
    // For PLANES: false rasterises the scene anew for each plane, to measure what coherence saves.
    bool planeCoherence = true;
    bool singleLine = false;  // whether a bundle is a single line through the whole scene
    std::vector<LineWindow> windows = {};  // for FRAGMENT_LISTS with CENTRE_SAMPLING
};

// Constructors of the projectors in the table.
std::unique_ptr<Projector> fragmentLists(const ProjectorInput& input);
std::unique_ptr<Projector> painter(const ProjectorInput& input);
std::unique_ptr<Projector> painterNewell(const ProjectorInput& input);
std::unique_ptr<Projector> plane(const ProjectorInput& input);
std::unique_ptr<Projector> planes(const ProjectorInput& input);

// Returns the projector of bundles that are single lines.
std::unique_ptr<Projector> singleLine(const ProjectorInput& input);

// Returns a projector of the given kind, or that of single lines if input.singleLine is set. Each
// thread needs its own projector, which keeps its memory from bundle to bundle.
std::unique_ptr<Projector> makeProjector(ProjectorKind kind, const ProjectorInput& input);

}  // namespace raybundle
