// SPDX-License-Identifier: GPL-3.0-or-later
//
// What turns a bundle into exchanges. Each projector is a file of its own and a row of the table in
// projector.cpp; their inner loops are their own, and only whole bundles go through this interface.
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

// What one bundle gives. Numbers of lines are integers also where a projector finds an exchange
// only with some probability p: it stands for 1 / p lines, rounded up or down at random without
// bias.
struct BundleLines {
    std::vector<Exchange> exchanges;  // equal pairs may occur several times
    std::vector<uint32_t> sky;        // sides from which a line leaves the scene, once per line
    std::vector<uint32_t>
        touching;  // sides that lie against another one, once per line; no exchange
    // Lines of one density after the other: how many of the finest lines one stands for, and where
    // they end in the lists above. Empty: each stands for itself.
    struct Density {
        uint32_t weight;
        size_t exchanges, sky, touching;
    };
    std::vector<Density> densities;
    uint64_t lines = 0;       // that meet the scene
    uint64_t disordered = 0;  // exchanges between sides whose order in depth is wrong (painters)
    uint64_t cycles = 0;      // of patches that cover each other, broken anywhere (Newell)

    // Calls visit(entry, weight) for all entries of a list.
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

class Projector {
  public:
    virtual ~Projector() = default;

    // Projects the scene along a bundle and appends its lines to `out`.
    virtual void project(const Bundle& bundle, BundleLines& out) = 0;
};

// What projectors are made of. References must outlive them.
struct ProjectorInput {
    const Patches& patches;
    const Visibility& visibility;
    float pixelSize;  // edge of a pixel in metres, the same for every bundle
    SmallPatches smallPatches = SmallPatches::CENTRE_SAMPLING;
    int planeCount = 4;  // of PLANES
    PlanePlacement planePlacement = PlanePlacement::SYSTEMATIC;
    // PLANES: false makes the depth buffers of each plane anew, to measure what coherence saves.
    bool planeCoherence = true;
    bool singleLine = false;               // a bundle is one line through the whole scene
    std::vector<LineWindow> windows = {};  // of FRAGMENT_LISTS with CENTRE_SAMPLING
};

// The projectors, one a row of the table.
std::unique_ptr<Projector> fragmentLists(const ProjectorInput& input);
std::unique_ptr<Projector> painter(const ProjectorInput& input);
std::unique_ptr<Projector> painterNewell(const ProjectorInput& input);
std::unique_ptr<Projector> plane(const ProjectorInput& input);
std::unique_ptr<Projector> planes(const ProjectorInput& input);

// The projector of bundles that are one line, instead of any row.
std::unique_ptr<Projector> singleLine(const ProjectorInput& input);

// A projector of a kind, or that of single lines. One object per thread: it keeps its memory from
// bundle to bundle.
std::unique_ptr<Projector> makeProjector(ProjectorKind kind, const ProjectorInput& input);

}  // namespace raybundle
