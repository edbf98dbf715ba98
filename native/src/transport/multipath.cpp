// SPDX-License-Identifier: GPL-3.0-or-later
//
// MULTIPATH: each line moves light in both directions between the sides that it joins. Along every
// line, a side sends light of the sources, and a fraction of the light that it has received but not
// sent yet (its unshot power).
//
// Sources: thesis section 2.4.1, figure 2.8 (single global lines: lines_per_bundle 1), sections
// 4.2-4.2.3 (bundles).
// Differs from figures 2.8 and 4.12:
// - All lines of a bundle read the unshot power that was there before the bundle. In the thesis,
//   the light that arrives through one pixel leaves through the next one along the same direction,
//   back to where it came from.
// - A line takes the fraction min(1, s^2 / A_i) of the unshot power (s^2: area of a pixel), so that
//   a bundle takes about cos(theta) of it. In the thesis, each line takes all of it, so that the
//   cosine of the direction has no effect.
// - Lines to the sky take their power away, and bring the light of the world.
// - The power per line is s^2 over the number of bundles, whatever number of lines was expected. In
//   the end, the power that arrived at a side is divided by the number of lines that met the side,
//   not by the expected number. Constant light is then right for any number of lines. With the
//   expected number, a plain under a sky took 87 times the bundles.
// - The light of the first shot is kept in the result. The figure loses it or counts it twice.
// - Power that is still unshot at the end would be missing. It is spread evenly over the sides that
//   light has reached, as in the ambient term of Cohen et al., "A Progressive Refinement Approach
//   to Fast Radiosity Image Generation" (1988), who spread it over all sides. Half of it counts as
//   bias.
// - The weight of a bundle (ADAPTIVE) and the number of lines that an exchange stands for (PLANE)
//   multiply the power that is sent. The fraction of the unshot power is then smaller. If a bundle
//   took more than all unshot power of a side, the fraction of this side is reduced for later
//   bundles. The fractions thus depend on earlier bundles only, not on the current one, so that the
//   mean stays right.
// thesis_literal follows figure 2.8 line by line, except that the light of the first shot is kept.

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "job/cancellation.h"
#include "scene/channels.h"
#include "transport/transport.h"

namespace raybundle {
namespace {

// Number of bundles that are traced before the directions learn from them.
constexpr uint32_t kBatch = 16;
// Factor on the unshot power that a bundle takes (about cos(theta) of it) if bundles or lines have
// weights. The largest weight of ADAPTIVE is the inverse of this factor.
constexpr float kWeightedShare = 0.3f;

// Threshold of irradiance, relative to the mean. Sides that receive more take a full part in the
// light of later bounces. A larger value loses that light on sides that few lines have met so far.
// A smaller value lights the outsides of rooms through their leaks.
constexpr double kLit = 0.33;

// The independent estimate of one half of the bundles. All vectors except `met` are per side.
// Powers are multiplied by the number of bundles.
struct Estimate {
    explicit Estimate(size_t sides)
        : perLine(sides, 0),
          unshot(sides, glm::vec3(0.0f)),
          direct(sides, glm::vec3(0.0f)),
          indirect(sides, glm::vec3(0.0f)),
          lines(sides, 0),
          skyLines(sides, 0),
          inBundle(sides, 0),
          fraction(sides, 0),
          arriving(sides, glm::vec3(0.0f)) {}

    uint32_t bundles = 0;
    std::vector<float> perLine;               // fraction of the unshot power that a line takes
    std::vector<glm::vec3> unshot;            // unshot power, W
    std::vector<glm::vec3> direct, indirect;  // received power, W
    // Number of lines so far, and of those to the sky, multiplied by the weights of their bundles.
    std::vector<double> lines, skyLines;

    // For the current bundle.
    std::vector<uint32_t> met;        // sides that lines met
    std::vector<uint32_t> inBundle;   // number of lines
    std::vector<float> fraction;      // fraction of the unshot power that a line takes
    std::vector<glm::vec3> arriving;  // arriving power, W
};

// The light that the power unshot at the end would bring.
struct Later {
    std::vector<float> area;  // per side: area on which it arrives, m^2
    // Irradiance on this area, W/m^2, times the number of bundles.
    glm::vec3 irradiance{0.0f};
};

class Multipath : public Transport {
  public:
    explicit Multipath(const TransportInput& input)
        : input(input),
          first(handOver(input, input.shot)),
          halves{Estimate(input.patches.sideCount()), Estimate(input.patches.sideCount())} {
        const bool isWeighted = rowOf(input.settings.directions).isWeighted ||
                                rowOf(input.settings.projector).isByChance;
        const float share = isWeighted ? kWeightedShare : 1;
        const double s2 = input.tracer.pixelArea;
        const size_t n = input.patches.sideCount();
        emission.resize(n);
        reflected.resize(n);
        for (size_t i = 0; i < n; ++i) {
            const double area = input.exposedArea(i);
            for (Estimate& e : halves) e.perLine[i] = share * (area > s2 ? float(s2 / area) : 1.0f);
            emission[i] = float(2 * s2) * input.shot.emission[i];
            reflected[i] = float(2 * s2) * first.unshot[i];
        }
        world = float(2 * s2) * glm::pi<float>() * input.worldRadiance;
    }

    void advance(uint32_t count, const Progress& progress) override {
        for (uint32_t done = 0; done < count;) {
            progress.report(RB_STAGE_BUNDLES, double(done) / count);
            const uint32_t step = std::min(kBatch, count - done);
            const std::vector<TracedBundle> traced = input.tracer.trace(step);
            std::vector<double> power(traced.size(), 0);
            auto advanceHalf = [&](uint32_t half) {
                for (size_t k = 0; k < traced.size(); ++k)
                    if (traced[k].bundle.half == half)
                        power[k] = input.settings.thesisLiteral
                                       ? exchangeLiterally(halves[half], traced[k])
                                       : exchange(halves[half], traced[k]);
            };
            parallelInvoke([&] { advanceHalf(0); }, [&] { advanceHalf(1); });
            for (size_t k = 0; k < traced.size(); ++k)
                input.tracer.learn(traced[k].bundle, power[k] / traced[k].bundle.weight);
            done += step;
        }
        progress.report(RB_STAGE_BUNDLES, 1);
    }

    uint32_t bundleCount() const override { return halves[0].bundles + halves[1].bundles; }

    Irradiance irradiance(Half half, float) override {
        const size_t n = input.patches.sideCount();
        Irradiance result(n);
        result.ofSources = result.direct = first.ofSources;
        result.indirect = first.indirect;
        for (int h = 0; h < 2; ++h) {
            if (half != Half::BOTH && h != int(half)) continue;
            const Estimate& estimate = halves[h];
            if (estimate.bundles == 0) continue;
            const float share = half == Half::BOTH ? 0.5f : 1.0f;
            const Later ambient = later(estimate);
            for (size_t i = 0; i < n; ++i) {
                const float area = float(input.exposedArea(i));
                if (area <= 0) continue;
                const float scale = share / (float(estimate.bundles) * area);
                // With thesis_literal, lines are not counted.
                const float perLine =
                    estimate.lines[i] > 0
                        ? share / float(2 * input.tracer.pixelArea * estimate.lines[i])
                        : scale;
                result.direct[i] += perLine * estimate.direct[i];
                result.indirect[i] +=
                    perLine * estimate.indirect[i] + scale * ambient.area[i] * ambient.irradiance;
            }
        }
        return result;
    }

    double bias() const override {
        double worst = 0;
        for (const Estimate& estimate : halves) {
            double ambient = 0, all = 0;
            const Later rest = later(estimate);
            for (size_t i = 0; i < estimate.unshot.size(); ++i) {
                ambient += double(rest.area[i]) * sumOfChannels(rest.irradiance);
                all += sumOfChannels(estimate.direct[i] + estimate.indirect[i]) +
                       estimate.bundles * input.exposedArea(i) *
                           sumOfChannels(first.ofSources[i] + first.indirect[i]);
            }
            if (all > 0) worst = std::max(worst, 0.5 * ambient / all);
        }
        return worst;
    }

    std::vector<float> openShare() const override {
        return openShareOf(
            input.patches.sideCount(),
            [&](size_t side) { return halves[0].lines[side] + halves[1].lines[side]; },
            [&](size_t side) { return halves[0].skyLines[side] + halves[1].skyLines[side]; });
    }

  private:
    // Moves the power of one bundle. Returns the power that arrived, W, times the number of bundles
    // and the weight of the bundle.
    double exchange(Estimate& e, const TracedBundle& traced) const {
        const float weight = float(traced.bundle.weight);
        auto meet = [&](uint32_t side, uint32_t lines) {
            if (e.inBundle[side] == 0) e.met.push_back(side);
            e.inBundle[side] += lines;
        };
        for (const Exchange& x : traced.lines.exchanges) {
            meet(x.i, x.lines);
            meet(x.j, x.lines);
        }
        for (uint32_t side : traced.lines.sky) {
            meet(side, 1);
            e.skyLines[side] += double(weight);
            e.direct[side] += weight * world;
            e.arriving[side] += weight * world;
        }
        for (uint32_t i : e.met) {
            const float lines = float(e.inBundle[i]);
            e.lines[i] += double(weight * lines);
            e.fraction[i] = weight * e.perLine[i];
            // Later bundles like this one take no more than all unshot power. This bundle took
            // more, so that the unshot power becomes negative and reduces what the side sends
            // later.
            const float all = lines * e.fraction[i];
            if (all > 1) e.perLine[i] /= all;
        }
        for (const Exchange& x : traced.lines.exchanges) {
            const float lines = float(x.lines);
            send(e, x.i, x.j, lines, weight);
            send(e, x.j, x.i, lines, weight);
        }
        double power = 0;
        for (uint32_t i : e.met) {
            power += sumOfChannels(e.arriving[i]);
            e.unshot[i] = e.unshot[i] * (1 - e.fraction[i] * float(e.inBundle[i])) +
                          input.patches.reflectance[i] * e.arriving[i];
            e.arriving[i] = glm::vec3(0.0f);
            e.inBundle[i] = 0;
        }
        e.met.clear();
        ++e.bundles;
        return power;
    }

    // Sends the light of side `from` along `lines` lines to side `to`.
    void send(Estimate& e, uint32_t from, uint32_t to, float lines, float weight) const {
        const glm::vec3 direct = weight * lines * emission[from];
        const glm::vec3 indirect =
            lines * (weight * reflected[from] + e.fraction[from] * e.unshot[from]);
        e.direct[to] += direct;
        e.indirect[to] += indirect;
        e.arriving[to] += direct + indirect;
    }

    // Moves the power of one bundle as in figure 2.8, line by line. Returns the moved power, W,
    // times the number of bundles.
    double exchangeLiterally(Estimate& e, const TracedBundle& traced) const {
        const std::vector<glm::vec3>& rho = input.patches.reflectance;
        double power = 0;
        for (const Exchange& x : traced.lines.exchanges)
            for (uint32_t line = 0; line < x.lines; ++line) {
                const glm::vec3 from1 = e.unshot[x.i], from2 = e.unshot[x.j];
                e.indirect[x.i] += from2 + reflected[x.j];
                e.indirect[x.j] += from1 + reflected[x.i];
                e.direct[x.i] += emission[x.j];
                e.direct[x.j] += emission[x.i];
                e.unshot[x.i] = rho[x.i] * (from2 + reflected[x.j] + emission[x.j]);
                e.unshot[x.j] = rho[x.j] * (from1 + reflected[x.i] + emission[x.i]);
                power += sumOfChannels(from1) + sumOfChannels(from2);
            }
        ++e.bundles;
        return power;
    }

    // Returns for each side the area on which light arrives that was reflected often, m^2, at most
    // its exposed area. This light is equal everywhere, except on sides that hardly receive any
    // light, such as the outsides of rooms.
    std::vector<float> reached(const Estimate& e) const {
        auto received = [&](size_t i) { return sumOfChannels(e.direct[i] + e.indirect[i]); };
        // ofPower / power is the mean irradiance, weighted by the received power.
        double ofPower = 0, power = 0;
        for (size_t i = 0; i < e.unshot.size(); ++i) {
            const double area = input.exposedArea(i);
            if (area <= 0) continue;
            ofPower += received(i) * received(i) / area;
            power += received(i);
        }
        std::vector<float> result(e.unshot.size(), 0.0f);
        if (!(ofPower > 0)) return result;
        for (size_t i = 0; i < result.size(); ++i)
            result[i] =
                float(std::min(input.exposedArea(i), received(i) * power / (kLit * ofPower)));
        return result;
    }

    // Returns the light that the power that is still unshot would bring over all later bounces.
    Later later(const Estimate& e) const {
        Later result;
        result.area = reached(e);
        if (input.settings.thesisLiteral) return result;
        glm::dvec3 unshot(0.0), received(0.0), reflected(0.0), open(0.0);
        double area = 0;
        for (size_t i = 0; i < e.unshot.size(); ++i) {
            const glm::dvec3 r(e.direct[i] + e.indirect[i]);
            unshot += e.unshot[i];
            received += r;
            reflected += r * glm::dvec3(input.patches.reflectance[i]);
            if (e.lines[i] > 0) open += r * (e.skyLines[i] / e.lines[i]);
            area += double(result.area[i]);
        }
        if (!(area > 0)) return result;
        for (int c = 0; c < 3; ++c) {
            if (!(received[c] > 0)) continue;
            const double staying = 1 - open[c] / received[c];
            const double power = staying * unshot[c] / (1 - staying * reflected[c] / received[c]);
            result.irradiance[c] = float(std::max(0.0, power) / area);
        }
        return result;
    }

    const TransportInput input;
    const HandOver first;
    std::array<Estimate, 2> halves;
    // The power that each line of a bundle brings, W, times the number of bundles: from a side its
    // emission and its reflected light of the first shot, and from the sky the light of the world.
    std::vector<glm::vec3> emission, reflected;
    glm::vec3 world{0.0f};
};

}  // namespace

std::unique_ptr<Transport> multipath(const TransportInput& input) {
    return std::make_unique<Multipath>(input);
}

}  // namespace raybundle
