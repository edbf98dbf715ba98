// SPDX-License-Identifier: GPL-3.0-or-later
#include "stated_error/surplus.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "job/cancellation.h"
#include "patches/neighbours.h"

namespace raybundle {
namespace {

// Light on a patch is too uncertain to be compared if its exposed share is not above this.
constexpr float kHalfCovered = 0.5f;
// A parent is too thin to be compared if its height is below this share of its longest edge: its
// neighbours have almost no distance, or are far away.
constexpr float kThin = 0.02f;
// Factors from the mean square of the change of the gradient between neighbours (a second
// derivative times an edge) to the mean square difference from the linear function. Only two of the
// four neighbours lie along each axis, but all of them show the mixed derivative.
constexpr float kStraight = 1.0f / 360, kMixed = 1.0f / 144;
// The corresponding factor for steps, see the head of surplus.h.
constexpr float kStep = 17.0f / 144 / 0.0933f;
// Change of light per radian by which the surface turns, relative to the light; and the mean square
// of a coordinate over a patch with edges of length 1, relative to its middle.
constexpr float kTurn = 0.5f, kSpread = 1.0f / 12;
// Contribution of noise to the square that measures steps, relative to the mean variance of two
// neighbours in a row of patches. The squared deviation from the gradients contains 1.25 times this
// variance. The squared change of the gradients, which is subtracted, contains it once. Negative
// differences count as 0.
constexpr float kDisagreementNoise = 0.85f;
// Neighbours whose directions are nearer to a common line than this do not define a gradient.
constexpr float kLeastSpread = 0.05f;

// The gradient of light in the plane of a patch.
struct Gradient {
    glm::vec3 alongA{0.0f}, alongB{0.0f};  // change of RGB per metre along each axis, W/m^3
};

// A patch, and what the light of its neighbours implies about the light on it.
struct Site {
    // Centre (m, relative to Patches::centre) and orthonormal axes of the plane.
    glm::vec3 centre{0.0f}, axisA{0.0f}, axisB{0.0f};
    bool isUsed = false, hasGradient = false;
    // Number of neighbours found, and number of neighbours of a patch away from borders.
    int neighbours = 0, wanted = 0;
    // Normal equations of two gradients: of all light, and of the light of the sources.
    float aa = 0, ab = 0, bb = 0;
    std::array<glm::vec3, 2> ra{glm::vec3(0.0f), glm::vec3(0.0f)};
    std::array<glm::vec3, 2> rb{glm::vec3(0.0f), glm::vec3(0.0f)};
    std::array<Gradient, 2> gradient;
    // Sums over the pairs with neighbours.
    int pairs = 0;
    float straight = 0, mixed = 0, step = 0, turn = 0;

    // Returns whether the patch has a neighbour on each side.
    bool isInside() const { return hasGradient && neighbours == wanted; }

    // Returns the offset to another site, unfolded into the plane of this one, m.
    glm::vec2 offset(const Site& other) const {
        const glm::vec3 d = other.centre - centre;
        const glm::vec2 flat(glm::dot(d, axisA), glm::dot(d, axisB));
        const float length = glm::length(flat);
        return length > 0 ? flat * (glm::length(d) / length) : flat;
    }

    // Computes the gradients, if the neighbours define them.
    void solve() {
        const float det = aa * bb - ab * ab;
        hasGradient = det > kLeastSpread * 0.25f * (aa + bb) * (aa + bb);
        if (!hasGradient) return;
        for (size_t f = 0; f < 2; ++f)
            gradient[f] = {(bb * ra[f] - ab * rb[f]) / det, (aa * rb[f] - ab * ra[f]) / det};
    }
};

// Returns the change of light per metre times `direction` (m), W/m^2.
glm::vec3 slope(const Gradient& g, glm::vec2 direction) {
    return direction.x * g.alongA + direction.y * g.alongB;
}

// The patches of some parents, with the light on one side of each.
class Sites {
  public:
    // For the arguments see surplusOf().
    Sites(const Patches& patches, uint32_t firstParent, uint32_t lastParent, rb_side side,
          const Irradiance& irradiance)
        : patches(patches),
          side(side),
          irradiance(irradiance),
          first(patches.parents[firstParent].firstPatch) {
        const Parent& last = patches.parents[lastParent - 1];
        sites.resize(last.firstPatch + last.patchCount() - first);
    }

    // Places the patches, and finds the pairs of neighbours that can be compared.
    void place(uint32_t firstParent, uint32_t lastParent, const std::vector<float>& exposed) {
        for (uint32_t p = firstParent; p < lastParent; ++p) {
            throwIfCancelledAt(p);
            const Parent& parent = patches.parents[p];
            const glm::vec3 axisA = glm::normalize(parent.a);
            const glm::vec3 axisB = glm::cross(parent.normal, axisA);
            const glm::vec2 middle = parent.isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f);
            const float longest =
                std::max({glm::length(parent.a), glm::length(parent.b),
                          parent.isTriangle ? glm::distance(parent.a, parent.b) : 0.0f});
            const bool isThin =
                glm::length(glm::cross(parent.a, parent.b)) < kThin * longest * longest;
            for (uint32_t k = 0; k < parent.patchCount(); ++k) {
                const uint32_t patch = parent.firstPatch + k;
                Site& site = of(patch);
                site.centre = parent.position(parent.pointOn(k, middle));
                site.axisA = axisA;
                site.axisB = axisB;
                site.isUsed = !isThin && exposed[2 * patch + uint32_t(side)] > kHalfCovered;
                site.wanted = parent.isTriangle ? 3 : 4;
            }
        }
        pairs = neighbouringTiles(patches, firstParent, lastParent);
        pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                                   [&](const TilePair& pair) {
                                       return !of(pair.first).isUsed || !of(pair.second).isUsed;
                                   }),
                    pairs.end());
    }

    // Computes the gradients on all patches.
    void findGradients() {
        for (const TilePair& pair : pairs) {
            throwIfCancelledAt(looked++);
            addNeighbour(pair.first, pair.second);
            addNeighbour(pair.second, pair.first);
        }
        for (Site& site : sites) site.solve();
    }

    // Compares the light and the gradients of all pairs. `directError` is per side, W/m^2.
    void comparePairs(const std::vector<float>& directError) {
        for (const TilePair& pair : pairs) {
            throwIfCancelledAt(looked++);
            compare(pair, directError);
        }
    }

    // Returns the surplus of each patch.
    std::vector<Surplus> surplus() const {
        std::vector<Surplus> result(sites.size());
        for (size_t k = 0; k < sites.size(); ++k) {
            const Site& site = sites[k];
            if (site.pairs == 0) continue;
            const glm::vec3 light = allLight(first + uint32_t(k));
            // Only half of the neighbours lie along each of the two axes, so the mean is doubled.
            const float turn = kTurn * kTurn * kSpread * 2 * site.turn / float(site.pairs);
            result[k] = {true,
                         (kStraight * site.straight + kMixed * site.mixed) / float(site.pairs) +
                             turn * glm::dot(light, light),
                         kStep * site.step};
        }
        return result;
    }

  private:
    Site& of(uint32_t patch) { return sites[patch - first]; }
    uint32_t sideOf(uint32_t patch) const { return 2 * patch + uint32_t(side); }
    glm::vec3 allLight(uint32_t patch) const { return irradiance.all(sideOf(patch)); }
    const glm::vec3& lightOfSources(uint32_t patch) const {
        return irradiance.ofSources[sideOf(patch)];
    }

    // Adds patch `b` to the normal equations of the gradients at patch `a`.
    void addNeighbour(uint32_t a, uint32_t b) {
        Site& site = of(a);
        const glm::vec2 d = site.offset(of(b));
        // All neighbours have the same weight, whatever their distance.
        const float weight = 1 / std::max(glm::dot(d, d), 1e-30f);
        ++site.neighbours;
        site.aa += weight * d.x * d.x;
        site.ab += weight * d.x * d.y;
        site.bb += weight * d.y * d.y;
        const std::array<glm::vec3, 2> changes{allLight(b) - allLight(a),
                                               lightOfSources(b) - lightOfSources(a)};
        for (size_t f = 0; f < 2; ++f) {
            site.ra[f] += weight * d.x * changes[f];
            site.rb[f] += weight * d.y * changes[f];
        }
    }

    // Compares the two patches of a pair and adds the result to both.
    void compare(const TilePair& pair, const std::vector<float>& directError) {
        Site &a = of(pair.first), &b = of(pair.second);
        // The gradient of a patch at a border is one-sided. The pair is used only if the other
        // patch lies inside.
        if (!a.hasGradient || !b.hasGradient || (!a.isInside() && !b.isInside())) return;
        const glm::vec2 dA = a.offset(b), dB = -b.offset(a);
        const glm::vec2 acrossA(-dA.y, dA.x), acrossB(-dB.y, dB.x);
        const glm::vec3 straight = slope(b.gradient[0], dB) - slope(a.gradient[0], dA);
        const glm::vec3 mixed = slope(b.gradient[0], acrossB) - slope(a.gradient[0], acrossA);
        const float cosine =
            glm::dot(patches.normal(2 * pair.first), patches.normal(2 * pair.second));
        // The square of the angle between the two planes.
        const float turn = 2 * std::max(0.0f, 1 - cosine);
        float step = 0;
        if (a.isInside() && b.isInside()) {
            const glm::vec3 foretold = 0.5f * (slope(a.gradient[1], dA) + slope(b.gradient[1], dB));
            const glm::vec3 off =
                lightOfSources(pair.second) - lightOfSources(pair.first) - foretold;
            const float errorA = directError[sideOf(pair.first)];
            const float errorB = directError[sideOf(pair.second)];
            // The standard error is that of the brightest channel, here assumed for all three.
            const glm::vec3 bend = slope(b.gradient[1], dB) - slope(a.gradient[1], dA);
            step = std::max(0.0f, glm::dot(off, off) - glm::dot(bend, bend)) -
                   3 * kDisagreementNoise * 0.5f * (errorA * errorA + errorB * errorB);
        }
        for (Site* site : {&a, &b}) {
            ++site->pairs;
            site->straight += glm::dot(straight, straight);
            site->mixed += glm::dot(mixed, mixed);
            site->turn += turn;
            // Each of the two patches gets half of a step between them.
            site->step += 0.5f * step;
        }
    }

    const Patches& patches;
    const rb_side side;
    const Irradiance& irradiance;
    const uint32_t first;  // index of the first patch
    std::vector<Site> sites;
    std::vector<TilePair> pairs;  // of neighbours that can both be compared
    size_t looked = 0;            // number of pairs, for cancellation
};

}  // namespace

std::vector<Surplus> surplusOf(const LitSurfaces& surfaces, uint32_t firstParent,
                               uint32_t lastParent, rb_side side, const Irradiance& irradiance,
                               const std::vector<float>& directError) {
    if (firstParent >= lastParent) return {};
    Sites sites(surfaces.patches, firstParent, lastParent, side, irradiance);
    sites.place(firstParent, lastParent, surfaces.exposed);
    sites.findGradients();
    sites.comparePairs(directError);
    return sites.surplus();
}

}  // namespace raybundle
