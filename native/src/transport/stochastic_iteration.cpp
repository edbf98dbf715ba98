// SPDX-License-Identifier: GPL-3.0-or-later
//
// STOCHASTIC_ITERATION with the ray-bundle operator. Each iterate is the light that one bundle
// brings to all sides at once, from the sources and from the light of the iterate before that sides
// reflect.
//
//   H_n = T_n (E + unshot + rho H_n-1),   H = mean of the H_n
//   (T_n x)_i = 2 s^2 / (A_i exposed_i) * sum of x_j over the bundle's lines between i and j
//
// E: emission left to the bundles, and pi L on lines to the sky; unshot: light of the first shot,
// reflected for the first time; A_i exposed_i: the part of the side that no other surface covers,
// m^2; s^2: area of a pixel, m^2.
//
// Sources: thesis section 2.6; Szirmay-Kalos, "Stochastic Iteration for Non-diffuse Global
// Illumination" (1999).
// Differs:
// - The first iterates lack the later bounces. Some of them are left out of the mean, at most a
//   quarter of the bundles of the first call. bias() returns the error of the others.
// - Each half of the bundles has its own iterates.
// - The mean light of a side is divided by the number of lines that met the side in all bundles,
//   not by the expected number. T_n itself remains unchanged.
// - Throws on scenes on which the mean square of the iterates would grow without bound
//   (mean_square_growth.cpp). The thesis gives no condition.
#include "transport/stochastic_iteration.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <glm/gtc/constants.hpp>

#include "job/cancellation.h"
#include "job/error.h"
#include "patches/side.h"
#include "scene/channels.h"

namespace raybundle {
namespace {

// Number of bundles of both halves that are traced at a time.
constexpr uint32_t kTracedAtOnce = 16;

// Properties of the sides and of the light, for both halves. Vectors are per side; `unshot` is in
// W/m^2.
struct Sides {
    std::vector<glm::vec3> reflectance, unshot;
    // Irradiance that one line brings, relative to the exitance at its other end.
    std::vector<float> perLine;
    glm::vec3 worldExitance;  // W/m^2
    bool hasDirect;           // whether there is direct light, of emission or the world
};

// The iterates of one half.
class Iterates {
  public:
    Iterates(const Sides& sides, const std::vector<glm::vec3>& emission)
        : sides(sides),
          exitance(emission.size()),
          received(emission.size()),
          totals(emission.size()),
          met(emission.size()),
          sky(emission.size()) {
        for (size_t i = 0; i < exitance.size(); ++i) exitance[i] = {emission[i], sides.unshot[i]};
    }

    // Computes the next iterate with the lines of a bundle. Adds its light to the mean if `counts`.
    void step(const BundleLines& lines, bool counts) {
        if (sides.hasDirect)
            step<true>(lines, counts);
        else
            step<false>(lines, counts);
    }

    // Return the number of iterates in the mean, and the sums of their direct and indirect
    // irradiance on a side, W/m^2.
    uint32_t counted() const { return count; }
    const glm::dvec3& direct(size_t side) const { return totals[side].direct; }
    const glm::dvec3& indirect(size_t side) const { return totals[side].indirect; }
    // Return the number of lines of a side in these bundles, and of those that left the scene.
    uint64_t lines(size_t side) const { return met[side]; }
    uint64_t skyLines(size_t side) const { return sky[side]; }

  private:
    struct Exitance {
        glm::vec3 emission{0.0f}, reflected{0.0f};
    };
    template <class Vector>
    struct Light {
        Vector direct{0.0f}, indirect{0.0f};
    };

    template <bool kHasDirect>
    void step(const BundleLines& lines, bool counts) {
        for (const Exchange& e : lines.exchanges) {
            const float n = float(e.lines);
            received[e.i].indirect += n * exitance[e.j].reflected;
            received[e.j].indirect += n * exitance[e.i].reflected;
            if (kHasDirect) {
                received[e.i].direct += n * exitance[e.j].emission;
                received[e.j].direct += n * exitance[e.i].emission;
            }
        }
        if (kHasDirect)
            for (uint32_t side : lines.sky) received[side].direct += sides.worldExitance;
        if (counts) {
            for (const Exchange& e : lines.exchanges) {
                met[e.i] += e.lines;
                met[e.j] += e.lines;
            }
            for (uint32_t side : lines.sky) {
                ++met[side];
                ++sky[side];
            }
            ++count;
        }
        for (size_t i = 0; i < received.size(); ++i) {
            const glm::vec3 direct = sides.perLine[i] * received[i].direct;
            const glm::vec3 indirect = sides.perLine[i] * received[i].indirect;
            exitance[i].reflected = sides.unshot[i] + sides.reflectance[i] * (direct + indirect);
            if (counts) {
                totals[i].direct += glm::dvec3(direct);
                totals[i].indirect += glm::dvec3(indirect);
            }
            received[i] = {};
        }
    }

    const Sides& sides;
    std::vector<Exitance> exitance;          // W/m^2
    std::vector<Light<glm::vec3>> received;  // sums of exitance over lines, W/m^2
    // Sums of the irradiance over the iterates in the mean, W/m^2.
    std::vector<Light<glm::dvec3>> totals;
    // Number of lines in the bundles of these iterates, and of those that left the scene.
    std::vector<uint64_t> met, sky;
    uint32_t count = 0;  // number of iterates in the mean
};

class BundleIteration : public Transport {
  public:
    explicit BundleIteration(const TransportInput& input) : input(input), sides(makeSides(input)) {
        assert(input.exposed.size() == input.patches.sideCount());
        // The first bundles serve to decide whether the iteration converges, and are then used.
        std::vector<TracedBundle> traced = input.tracer.trace(kTracedAtOnce);
        refuseIfUnstable(traced);
        keep(std::move(traced));
    }

    void advance(uint32_t count, const Progress& progress) override {
        assert(count % 2 == 0 && "two halves of equal size");
        if (done == 0)
            warmUp = warmUpIterates(largestReflectance(input.patches), kMissing, count / 8);
        for (uint32_t left = count / 2; left > 0;) {
            progress.report(RB_STAGE_BUNDLES, 1 - 2.0 * left / count);
            if (next == waiting[0].size())
                keep(input.tracer.trace(std::min(kTracedAtOnce, 2 * left)));
            const uint32_t steps = uint32_t(std::min<size_t>(left, waiting[0].size() - next));
            auto go = [&](size_t half) {
                for (uint32_t k = 0; k < steps; ++k)
                    halves[half].step(waiting[half][next + k].lines, done + k >= warmUp);
            };
            parallelInvoke([&] { go(0); }, [&] { go(1); });
            next += steps;
            done += steps;
            left -= steps;
        }
        progress.report(RB_STAGE_BUNDLES, 1);
    }

    uint32_t bundleCount() const override { return 2 * done; }

    Irradiance irradiance(Half half, float) override {
        const HandOver first = handOver(input, input.shot);
        Irradiance result(sides.unshot.size());
        for (size_t i = 0; i < sides.unshot.size(); ++i) {
            const auto [direct, indirect] = mean(half, i);
            result.ofSources[i] = first.ofSources[i];
            result.direct[i] = first.ofSources[i] + glm::vec3(direct);
            result.indirect[i] = first.indirect[i] + glm::vec3(indirect);
        }
        return result;
    }

    // Returns the relative error by the bounces that the iterates lack. Iterate n lacks the bounces
    // after the n-th, which are rho^n of the light by lines. rho is the mean reflectance that this
    // light meets, with the sky counted as black. The mean over N iterates, after w iterates that
    // are left out, is rho^(w+1) (1 - rho^N) / (N (1 - rho)).
    double bias() const override {
        const std::vector<float> open = openShare();
        double arriving = 0, goingOn = 0, all = 0;
        for (size_t i = 0; i < open.size(); ++i) {
            const auto [direct, indirect] = mean(Half::BOTH, i);
            const glm::dvec3 light = direct + indirect;
            const double area = input.exposedArea(i);
            arriving += area * sumOfChannels(light);
            goingOn += area * std::max(0.0, 1 - double(open[i])) *
                       sumOfChannels(glm::dvec3(sides.reflectance[i]) * light);
            glm::dvec3 fromShot(input.shot.irradiance[i]);
            if (!input.shot.indirect.empty()) fromShot += glm::dvec3(input.shot.indirect[i]);
            all += area * sumOfChannels(light) +
                   double(input.patches.area[patchOf(i)]) * sumOfChannels(fromShot);
        }
        const double n = halves[0].counted();
        if (!(arriving > 0) || n == 0) return 0;
        const double rho = std::min(goingOn / arriving, 0.999);
        return arriving / all * std::pow(rho, warmUp + 1) * (1 - std::pow(rho, n)) /
               (n * (1 - rho));
    }

    std::vector<float> openShare() const override {
        return openShareOf(
            sides.perLine.size(),
            [&](size_t side) { return halves[0].lines(side) + halves[1].lines(side); },
            [&](size_t side) { return halves[0].skyLines(side) + halves[1].skyLines(side); });
    }

  private:
    static Sides makeSides(const TransportInput& input) {
        const Patches& patches = input.patches;
        Sides sides{patches.reflectance, handOver(input, input.shot).unshot,
                    std::vector<float>(patches.sideCount()), glm::pi<float>() * input.worldRadiance,
                    false};
        const glm::vec3 black(0.0f);
        sides.hasDirect = input.worldRadiance != black;
        for (size_t i = 0; i < patches.sideCount(); ++i) {
            const double area = input.exposedArea(i);
            sides.perLine[i] = area > 0 ? float(2 * input.tracer.pixelArea / area) : 0;
            sides.hasDirect |= input.shot.emission[i] != black;
        }
        return sides;
    }

    void refuseIfUnstable(const std::vector<TracedBundle>& traced) const {
        const double growth = meanSquareGrowth(input, traced);
        if (growth < 1) return;
        char number[32];
        std::snprintf(number, sizeof(number), "%.3g", growth);
        throw invalidArgument(
            "solver STOCHASTIC_ITERATION does not converge on this scene: with each bundle, the "
            "mean square of its noise would grow by a factor of " +
            std::string(number) +
            ", and this factor must be below 1. Reduce the reflectances (large patches allow up to "
            "0.86), increase lines_per_bundle or patch_size until the patches are larger than the "
            "distance between lines, or choose solver LINE_REUSE, MULTIPATH or RANDOM_WALK");
    }

    // Replaces the waiting bundles, all of which must have been used.
    void keep(std::vector<TracedBundle> traced) {
        for (auto& bundles : waiting) bundles.clear();
        for (TracedBundle& t : traced) waiting[t.bundle.half].push_back(std::move(t));
        next = 0;
    }

    // Returns the mean direct and indirect irradiance of a side, W/m^2. The sums are divided by the
    // lines that met the side, not by the expected number, so that constant light is right for any
    // number of lines.
    std::pair<glm::dvec3, glm::dvec3> mean(Half half, size_t side) const {
        glm::dvec3 direct(0.0), indirect(0.0);
        double count = 0;
        for (size_t h = 0; h < 2; ++h) {
            if (half != Half::BOTH && h != size_t(half)) continue;
            direct += halves[h].direct(side);
            indirect += halves[h].indirect(side);
            count += double(sides.perLine[side]) * double(halves[h].lines(side));
        }
        if (!(count > 0)) return {glm::dvec3(0.0), glm::dvec3(0.0)};
        return {direct / count, indirect / count};
    }

    const TransportInput input;
    const Sides sides;
    std::array<Iterates, 2> halves{Iterates(sides, input.shot.emission),
                                   Iterates(sides, input.shot.emission)};
    std::array<std::vector<TracedBundle>, 2> waiting;  // per half: traced bundles
    size_t next = 0;      // number of bundles in each list that have been used
    uint32_t done = 0;    // number of bundles used in each half
    uint32_t warmUp = 0;  // number of these bundles that are left out of the mean
};

}  // namespace

std::unique_ptr<Transport> stochasticIteration(const TransportInput& input) {
    if (input.settings.linesPerBundle == 1) return singleRayIteration(input);
    return std::make_unique<BundleIteration>(input);
}

}  // namespace raybundle
