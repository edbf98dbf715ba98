// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bundles of one line: a random line through the whole scene, which is traced instead of projected.
// All its crossings count. They are ordered and paired like the list of one pixel in
// fragment_lists.cpp.
//
// Sources: thesis sections 2.3.2 and 2.4.1, figure 2.8 (multipath by single global lines).
// Differs: a line is given by a direction and a point on the disc across it, instead of two points
// on the sphere around the scene. Both have the uniform density of global lines (Crofton). With the
// directions of the other projectors, low discrepancy and importance sampling also apply to single
// lines.
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <utility>
#include <vector>

#include "bundles/depth_order.h"
#include "bundles/projector.h"
#include "patches/side.h"

namespace raybundle {
namespace {

class SingleLine : public Projector {
  public:
    explicit SingleLine(const ProjectorInput& input) : input(input), depthOrder(input.patches) {}

    void project(const Bundle& bundle, BundleLines& out) override {
        // Uniform on a disc with the radius of the sphere around the scene.
        const double r = double(input.patches.radius) * std::sqrt(bundle.shift.x);
        const double phi = glm::two_pi<double>() * bundle.shift.y;
        input.visibility.lineHits(r * (std::cos(phi) * bundle.right + std::sin(phi) * bundle.up),
                                  bundle.direction, hits);
        if (hits.empty()) return;
        depthOrder.begin(bundle.direction);
        for (size_t a = 1; a < hits.size(); ++a)
            for (size_t b = a; b > 0 && depthOrder.belongBackwards(hits[b - 1].side, hits[b].side,
                                                                   along(hits[b - 1], hits[b]));
                 --b)
                std::swap(hits[b], hits[b - 1]);

        ++out.lines;
        out.sky.push_back(hits.front().side);
        for (size_t k = 0; k + 1 < hits.size(); ++k) {
            const uint32_t i = opposite(hits[k].side), j = hits[k + 1].side;
            if (depthOrder.touches(hits[k].side, j, along(hits[k], hits[k + 1]))) {
                out.touching.push_back(i);
                out.touching.push_back(j);
            } else {
                out.exchanges.push_back({std::min(i, j), std::max(i, j), 1});
            }
        }
        out.sky.push_back(opposite(hits.back().side));
    }

  private:
    static double along(const LineHit& a, const LineHit& b) { return b.depth - a.depth; }

    const ProjectorInput input;
    DepthOrder depthOrder;
    std::vector<LineHit> hits;
};

}  // namespace

std::unique_ptr<Projector> singleLine(const ProjectorInput& input) {
    return std::make_unique<SingleLine>(input);
}

}  // namespace raybundle
