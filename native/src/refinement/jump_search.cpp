// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/jump_search.h"

#include <algorithm>
#include <cmath>

namespace raybundle {
namespace {

// The light at the ends of an edge is measured at this share of the edge from its ends.
constexpr double kEnd = 0.02;
// Edges of the source are measured at this share of the way to the opposite corner, so that at the
// edge of a room the point does not lie in the next wall.
constexpr double kInside = 0.01;
// Number of halvings by which the place of a jump is found on an edge.
constexpr int kHalvings = 6;
// Light jumps if at least the share kMostOfJump of the difference between the ends of an edge lies
// within one of these shares of the edge. Within the first one, the edge of a shadow is as hard as
// can be seen.
constexpr double kWidths[] = {0.03, 0.06, 0.12, 0.25, 0.5}, kMostOfJump = 0.75;
// The best of three halves of an edge that begin at its quarters holds at least this share of a
// change that takes half an edge.
constexpr double kOfBestHalf = 0.75;

}  // namespace

JumpEdge::JumpEdge(const RefinedMesh& mesh, uint32_t id)
    : id(id),
      isOfSource(mesh.triangles()[id / 3].sourceEdge[id % 3] >= 0),
      from(mesh.position(mesh.triangles()[id / 3], id % 3)),
      to(mesh.position(mesh.triangles()[id / 3], (id + 1) % 3)),
      third(mesh.position(mesh.triangles()[id / 3], (id + 2) % 3)),
      low(kEnd),
      high(1 - kEnd) {}

void JumpEdge::take(size_t side, const Light& light) {
    const double share = next(side);
    if (!light) {
        if (!covered) covered = {share, share};
        (*covered)[side] = share;
        return;
    }
    const bool isLow = glm::distance(*light, atFrom) < glm::distance(*light, atTo);
    // Otherwise the light jumps beside what covers the edge.
    if (isLow != (side == 0)) covered.reset();
    (isLow ? low : high) = share;
}

bool JumpEdge::mayBeHard(const std::array<Light, 3>& quarters) const {
    if (!quarters[0] || !quarters[1] || !quarters[2]) return true;
    const float most =
        std::max({glm::distance(atFrom, *quarters[1]), glm::distance(*quarters[0], *quarters[2]),
                  glm::distance(*quarters[1], atTo)});
    return double(most) > kOfBestHalf * kMostOfJump * difference();
}

void JumpSearch::search(std::vector<uint32_t> triangles) {
    for (const uint32_t t : triangles) isTaken[t] = 1;
    while (!triangles.empty()) {
        const std::vector<uint32_t> found = jumping(triangles);
        triangles.clear();
        for (const uint32_t e : found)
            for (const uint32_t beside : mesh.ringOf(edges[e].id)) {
                if (isTaken[beside / 3]) continue;
                isTaken[beside / 3] = 1;
                triangles.push_back(beside / 3);
            }
    }
}

std::pair<uint32_t, bool> JumpSearch::find(uint32_t triangle, uint32_t k) {
    const std::vector<uint32_t> ring = mesh.ringOf(3 * triangle + k);
    const uint32_t id = *std::min_element(ring.begin(), ring.end());
    const auto [found, isNew] = indices.try_emplace(id, uint32_t(edges.size()));
    if (isNew) edges.emplace_back(mesh, id);
    return {found->second, isNew};
}

void JumpSearch::keepJumps(std::vector<uint32_t>& these) const {
    these.erase(
        std::remove_if(these.begin(), these.end(), [&](uint32_t e) { return !edges[e].jumps; }),
        these.end());
}

std::vector<uint32_t> JumpSearch::jumping(const std::vector<uint32_t>& triangles) {
    std::vector<uint32_t> these;
    for (const uint32_t t : triangles)
        for (uint32_t k = 0; k < 3; ++k)
            if (const auto [index, isNew] = find(t, k); isNew) these.push_back(index);
    auto measure = [&](auto share) {
        std::vector<double> shares;
        for (const uint32_t e : these) shares.push_back(share(edges[e]));
        return lightAt(these, shares);
    };
    auto measureAt = [&](double share) {
        return lightAt(these, std::vector<double>(these.size(), share));
    };
    const std::vector<Light> first = measureAt(kEnd), last = measureAt(1 - kEnd);
    for (size_t k = 0; k < these.size(); ++k) {
        JumpEdge& edge = edges[these[k]];
        if (!first[k] || !last[k]) continue;
        edge.atFrom = *first[k];
        edge.atTo = *last[k];
        edge.jumps = edge.difference() > leastJump;
    }
    keepJumps(these);
    const std::array<std::vector<Light>, 3> quarters{measureAt(0.25), measureAt(0.5),
                                                     measureAt(0.75)};
    for (size_t k = 0; k < these.size(); ++k)
        edges[these[k]].jumps =
            edges[these[k]].mayBeHard({quarters[0][k], quarters[1][k], quarters[2][k]});
    keepJumps(these);
    for (int step = 0; step < kHalvings; ++step)
        for (const size_t side : {0, 1}) {
            const std::vector<Light> found = measure([side](const JumpEdge& edge) {
                return side == 0 || edge.covered ? edge.next(side) : NAN;
            });
            for (size_t k = 0; k < these.size(); ++k)
                if (JumpEdge& edge = edges[these[k]]; side == 0 || edge.covered)
                    edge.take(side, found[k]);
        }
    measureWidths(these);
    keepJumps(these);
    return these;
}

void JumpSearch::measureWidths(const std::vector<uint32_t>& these) {
    for (const uint32_t e : these) edges[e].jumps = false;
    for (const double width : kWidths) {
        std::vector<uint32_t> open;
        std::vector<double> before, after;
        for (const uint32_t e : these) {
            const JumpEdge& edge = edges[e];
            if (edge.jumps) continue;
            const double half = 0.5 * (width + edge.coveredWidth());
            open.push_back(e);
            before.push_back(std::max(kEnd, edge.share() - half));
            after.push_back(std::min(1 - kEnd, edge.share() + half));
        }
        const std::vector<Light> low = lightAt(open, before), high = lightAt(open, after);
        for (size_t k = 0; k < open.size(); ++k) {
            JumpEdge& edge = edges[open[k]];
            edge.width = width > kWidths[0] ? width / kMostOfJump : 0;
            edge.jumps = low[k] && high[k] &&
                         double(glm::distance(*low[k], *high[k])) > kMostOfJump * edge.difference();
        }
    }
}

std::vector<JumpSearch::Light> JumpSearch::lightAt(const std::vector<uint32_t>& these,
                                                   const std::vector<double>& shares) {
    std::vector<FacePlace> places;
    for (size_t k = 0; k < these.size(); ++k) {
        const JumpEdge& edge = edges[these[k]];
        glm::dvec3 at = edge.at(shares[k]);
        if (edge.isOfSource) at += kInside * (edge.third - at);
        places.push_back({mesh.triangles()[edge.id / 3].face, at, these[k]});
    }
    return light.at(places);
}

}  // namespace raybundle
