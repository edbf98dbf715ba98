// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/painter.h"

#include <algorithm>
#include <utility>

#include "bundles/newell_order.h"
#include "patches/side.h"

namespace raybundle {
namespace {

constexpr uint32_t kEmpty = UINT32_MAX;
constexpr uint32_t kSlots = 16;  // of RunLengths

// Order by the depth of the centroids, as in the thesis. This is not an order of visibility: the
// centroid of a long patch in front of a small one may lie behind it.
class CentroidOrder : public PatchOrder {
  public:
    explicit CentroidOrder(const Patches& patches) {
        centroids.reserve(patches.count());
        for (uint32_t patch = 0; patch < patches.count(); ++patch) {
            const bool isTriangle = patches.parents[patches.parentOf[patch]].isTriangle;
            centroids.emplace_back(patches.point(patch, glm::vec2(isTriangle ? 1.0f / 3 : 0.5f)));
        }
    }

    uint64_t sort(const Bundle& bundle, std::vector<uint32_t>& drawn) override {
        keys.clear();
        for (uint32_t patch : drawn)
            keys.emplace_back(glm::dot(glm::dvec3(centroids[patch]), bundle.direction), patch);
        std::sort(keys.begin(), keys.end());
        for (size_t k = 0; k < keys.size(); ++k) drawn[k] = keys[k].second;
        return 0;
    }

  private:
    std::vector<glm::vec3> centroids;  // per patch, metres, relative to Patches::centre
    std::vector<std::pair<double, uint32_t>> keys;
};

}  // namespace

std::unique_ptr<Projector> painter(const ProjectorInput& input) {
    return std::make_unique<Painter>(input, std::make_unique<CentroidOrder>(input.patches));
}

std::unique_ptr<Projector> painterNewell(const ProjectorInput& input) {
    return std::make_unique<Painter>(input, std::make_unique<NewellOrder>(input.patches));
}

Painter::Painter(const ProjectorInput& input, std::unique_ptr<PatchOrder> order)
    : order(std::move(order)),
      depthOrder(input.patches),
      hasLeaks(input.smallPatches == SmallPatches::ROULETTE),
      rasteriser(input.patches, input.pixelSize, input.smallPatches),
      place(input.patches.count()) {}

void Painter::project(const Bundle& bundle, BundleLines& out) {
    rasteriser.begin(bundle);
    depthOrder.begin(bundle.direction);
    fragments.clear();
    drawn.clear();
    std::fill(place.begin(), place.end(), 0);
    rasteriser.forEachFragment([&](uint32_t pixel, double depth, uint32_t side) {
        fragments.push_back({depth, pixel, side});
        if (place[patchOf(side)]++ == 0) drawn.push_back(patchOf(side));
    });
    out.cycles += order->sort(bundle, drawn);
    group(drawn);
    paint(out);
}

void Painter::group(const std::vector<uint32_t>& sorted) {
    uint32_t next = 0;
    for (uint32_t patch : sorted) next += std::exchange(place[patch], next);
    strokes.resize(fragments.size());
    for (const Fragment& f : fragments) strokes[place[patchOf(f.side)]++] = f;
}

void Painter::paint(BundleLines& out) {
    pixels.assign(rasteriser.pixelCount(), {0, kEmpty});
    for (const Fragment& f : strokes) {
        Pixel& pixel = pixels[f.pixel];
        if (pixel.side == kEmpty) {
            ++out.lines;
            out.sky.push_back(f.side);
        } else {
            // The far side of the previous patch sees the near side of the current one.
            const uint32_t i = opposite(pixel.side), j = f.side;
            const double along = f.depth - pixel.depth;
            const bool touches = depthOrder.touches(pixel.side, j, along);
            if (touches) {
                out.touching.push_back(i);
                out.touching.push_back(j);
            } else {
                runs.add(i / 2 % kSlots, i, j);
            }
            // A contact in the wrong order counts, too, since the surfaces before and behind it see
            // the wrong sides.
            if (depthOrder.isDisordered(pixel.side, j, along) ||
                (hasLeaks && !touches && depthOrder.passesIntoSolid(i, j)))
                ++out.disordered;
        }
        pixel = {f.depth, f.side};
    }
    for (const Pixel& pixel : pixels)
        if (pixel.side != kEmpty) out.sky.push_back(opposite(pixel.side));
    runs.moveTo(out.exchanges);
}

}  // namespace raybundle
