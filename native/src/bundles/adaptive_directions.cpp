// SPDX-License-Identifier: GPL-3.0-or-later
//
// ADAPTIVE: directions along which much power was transported are chosen more often.
//
// The hemisphere is divided into regions of equal solid angle Omega_i. Region i is chosen with the
// probability
//
//   p_i = (1 - a) phi_i + a Omega_i / 2 pi.
//
// A direction within the region is uniform, and the power that the bundle transports is multiplied
// by (Omega_i / 2 pi) / p_i, which is at most 1 / a.
//
// Source: thesis section 4.5.
// Differs:
// - A share a of the directions is uniform (defensive mixture). In the thesis, one poor probe
//   removes a region for ever, which is a bias, and weights have no bound, although they multiply
//   along the path of the light.
// - phi_i is proportional to the root of the mean square of the power in the region, not to the
//   mean. Directions are uniform within a region, so the variance of the estimate, sum_i Omega_i^2
//   E_i[power^2] / p_i, is least for p_i ~ Omega_i sqrt(E_i[power^2]). The two differ if one part
//   of a region is bright, and such a region deserves more directions.
// - There is no initial probe of each region. A region counts as if it had been probed once, with
//   the mean power of all regions as the result.
// - The direction of a bundle depends on previous bundles only, so each bundle is unbiased.
#include <algorithm>
#include <array>
#include <cmath>

#include "bundles/directions.h"

namespace raybundle {
namespace {

constexpr int kRings = 8, kSectors = 8, kRegions = kRings * kSectors;
constexpr double kUniformShare = 0.3;  // a in the formula above

class AdaptiveDirections : public DirectionSequence {
  public:
    AdaptiveDirections() { probability.fill(1.0 / kRegions); }

    Direction at(uint32_t, std::mt19937_64& random) override {
        if (isOld) update();
        double left = uniform(random);
        int region = 0;
        while (region + 1 < kRegions && left >= probability[size_t(region)])
            left -= probability[size_t(region++)];
        const double u = (region / kSectors + uniform(random)) / kRings;
        const double v = (region % kSectors + uniform(random)) / kSectors;
        return {onHemisphere(u, v), 1 / (kRegions * probability[size_t(region)])};
    }

    void learn(const glm::dvec3& direction, double power) override {
        Learned& learned = regions[size_t(regionOf(direction))];
        learned.squares += power * power;
        learned.bundles += 1;
        isOld = true;
    }

  private:
    struct Learned {
        double squares = 0, bundles = 0;  // sum of power^2, W^2, and number of bundles

        double root() const { return bundles > 0 ? std::sqrt(squares / bundles) : 0; }  // W
    };

    // Inverts onHemisphere().
    static int regionOf(const glm::dvec3& direction) {
        const double turn = std::atan2(direction.y, direction.x) / (2 * std::acos(-1.0));
        const int ring = std::clamp(int(direction.z * kRings), 0, kRings - 1);
        const int sector =
            std::clamp(int((turn < 0 ? turn + 1 : turn) * kSectors), 0, kSectors - 1);
        return ring * kSectors + sector;
    }

    void update() {
        // The mean over the hemisphere is taken to be that of the regions with bundles.
        double mean = 0, looked = 0;
        for (const Learned& l : regions)
            if (l.bundles > 0) {
                mean += l.root();
                looked += 1;
            }
        mean /= looked;
        double sum = 0;
        for (size_t i = 0; i < kRegions; ++i) {
            const Learned& l = regions[i];
            probability[i] = (mean + l.bundles * l.root()) / (1 + l.bundles);
            sum += probability[i];
        }
        for (double& p : probability)
            p = kUniformShare / kRegions +
                (1 - kUniformShare) * (sum > 0 ? p / sum : 1.0 / kRegions);
        isOld = false;
    }

    std::array<Learned, kRegions> regions;
    std::array<double, kRegions> probability;
    bool isOld = false;  // whether learn() was called since `probability` was computed
};

}  // namespace

std::unique_ptr<DirectionSequence> adaptiveDirections(std::mt19937_64&) {
    return std::make_unique<AdaptiveDirections>();
}

}  // namespace raybundle
