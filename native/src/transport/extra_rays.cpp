// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/extra_rays.h"

#include <algorithm>
#include <glm/gtc/constants.hpp>
#include <memory>

#include "job/cancellation.h"
#include "patches/side.h"
#include "sampling/sobol.h"
#include "sampling/sphere_sampling.h"
#include "transport/sent_light.h"
#include "visibility/local_lines.h"

namespace raybundle {
namespace {

// The light of one set: the exitance of sides by the joint estimate of both halves, and by the
// estimate of each half.
struct Sent {
    Sent(const LitSurfaces& surfaces, const SetLight& light,
         const std::array<Irradiance, 2>& halves)
        : emission(light.shot.emission), world(glm::pi<float>() * light.worldRadiance) {
        auto of = [&](const Irradiance& irradiance) {
            return std::make_unique<SentLight>(surfaces, light.shot, irradiance,
                                               SentLight::Of::BEYOND_FIRST_SHOT);
        };
        by[0] = of(light.irradiance);
        for (size_t h = 0; h < 2; ++h) by[1 + h] = of(halves[h]);
    }

    const std::vector<glm::vec3>& emission;        // per side, W/m^2
    const glm::vec3 world;                         // exitance of the world, W/m^2
    std::array<std::unique_ptr<SentLight>, 3> by;  // by both halves, by each half
};

// Returns the irradiance of the exposed part of a side by reflected light that the first shot has
// already distributed, W/m^2.
glm::vec3 alreadyIndirect(const FirstShot& shot, const std::vector<float>& exposed, uint32_t side) {
    return shot.indirect.empty() || !(exposed[side] > 0) ? glm::vec3(0.0f)
                                                         : shot.indirect[side] / exposed[side];
}

// Sums over rays of the light that they brought: emission and world, and reflected light; W/m^2.
struct Brought {
    glm::vec3 carried{0.0f}, reflected{0.0f};
};

// The balance is kept only if the wanted sides met at least this many lines, whose mean is then
// accurate to about 0.5 %.
constexpr double kTellingLines = 40000;

// The share of all absorbed power that rays may add or remove. Lines conserve the power of all
// sides together. They give the power of a few sides only with noise, because the lines of a bundle
// have common errors. To keep the power of the wanted sides exactly as the lines gave it would undo
// the effect of the rays: 5 of 14 objects of house_on_plain would then be above 4 % at the 95th
// percentile, instead of 1 object.
constexpr double kMostMade = 1e-4;

// Returns the irradiance that lines and rays bring to a side, W/m^2. `already` is the result of
// alreadyIndirect().
glm::vec3 broughtTo(uint32_t side, const Irradiance& light, const glm::vec3& already) {
    return light.all(side) - light.ofSources[side] - already;
}

// Joins the estimate from `lines` lines with the sums that `rays` rays brought.
void blend(Irradiance& light, uint32_t side, float lines, const Brought& brought, float rays,
           const glm::vec3& already) {
    if (!(rays > 0)) return;
    const float share = 1 / (lines + kLinesOfRay * rays);
    const glm::vec3 carried = light.direct[side] - light.ofSources[side];
    const glm::vec3 reflected = light.indirect[side] - already;
    light.direct[side] =
        light.ofSources[side] + share * (lines * carried + kLinesOfRay * brought.carried);
    light.indirect[side] = already + share * (lines * reflected + kLinesOfRay * brought.reflected);
}

using Samples = std::vector<std::array<float, 2>>;  // per side and half

// The rays of the wanted sides, and the light that they bring to each light set.
class ExtraGather {
  public:
    ExtraGather(const ExtraRaysInput& input, const Samples& samples, const SetLights& lights)
        : surfaces(input),
          wanted(input.wanted),
          samples(samples),
          brought(wanted.size() * lights.size()),
          counted(wanted.size(), {0, 0}),
          lightCount(lights.size()) {
        for (const ExtraRays& own : wanted)
            linesMet += double(samples[own.side][0]) + double(samples[own.side][1]);
    }

    // Casts all rays. `sent` is per light.
    void cast(const ExtraRaysInput& input, const std::vector<Sent>& sent) {
        parallelFor(size_t(0), wanted.size(), [&](size_t w) { castThose(w, input, sent); });
    }

    // Joins light k with the light that its rays brought. `of` is 0 for the joint estimate of both
    // halves, and 1 or 2 for the estimate of a half.
    void bring(size_t k, size_t of, const FirstShot& shot, Irradiance& light) const {
        std::vector<glm::vec3> change(wanted.size());
        for (size_t w = 0; w < wanted.size(); ++w) {
            const uint32_t side = wanted[w].side;
            const std::array<float, 2>&lines = samples[side], &rays = counted[w];
            const glm::vec3 already = alreadyIndirect(shot, surfaces.exposed, side);
            const glm::vec3 before = broughtTo(side, light, already);
            blend(light, side, of == 0 ? lines[0] + lines[1] : lines[of - 1],
                  brought[w * lightCount + k][of], of == 0 ? rays[0] + rays[1] : rays[of - 1],
                  already);
            change[w] = broughtTo(side, light, already) - before;
        }
        if (linesMet >= kTellingLines) keepBalance(change, shot, light);
    }

    // Adds the rays to the samples of their sides.
    void count(Samples& all) const {
        for (size_t w = 0; w < wanted.size(); ++w)
            for (size_t h = 0; h < 2; ++h) all[wanted[w].side][h] += kLinesOfRay * counted[w][h];
    }

  private:
    // Casts the rays of the w-th wanted side.
    void castThose(size_t w, const ExtraRaysInput& input, const std::vector<Sent>& sent) {
        const ExtraRays& own = wanted[w];
        const SobolPoints points(hash(input.seed, own.side));
        for (uint32_t i = 0; i < own.rays; ++i) {
            throwIfCancelledAt(i);
            const glm::vec4 u = points[i];
            const glm::vec3 direction =
                cosineDirection(surfaces.patches.normal(own.side), {u.z, u.w});
            float distance = 0;
            const auto hit = input.visibility.firstHit(
                own.side, surfaces.patches.point(patchOf(own.side), {u.x, u.y}), direction,
                &distance);
            if (hit && isCovered(surfaces.patches, own.side, *hit, direction, distance)) continue;
            if (hit && !(std::min(samples[*hit][0], samples[*hit][1]) > 0)) continue;
            // The first half of the Sobol points and the second half are each stratified.
            const size_t half = 2 * i < own.rays ? 0 : 1;
            ++counted[w][half];
            for (size_t k = 0; k < sent.size(); ++k)
                for (const size_t of : {size_t(0), 1 + half}) {
                    Brought& sum = brought[w * lightCount + k][of];
                    sum.carried += hit ? sent[k].emission[*hit] : sent[k].world;
                    if (hit) sum.reflected += sent[k].by[of]->towards(*hit, -direction);
                }
        }
    }

    // Returns the area of a side times the share of light that it absorbs, by channel, m^2.
    glm::dvec3 absorbing(uint32_t side) const {
        return surfaces.exposedArea(side) * glm::dvec3(1.0f - surfaces.patches.reflectance[side]);
    }

    // Removes the power that the rays added beyond kMostMade, from each side in proportion to the
    // amount by which the rays changed it. Sides that the rays hardly changed are thus hardly
    // affected, such as those that see only an even sky and have no noise. `change` is the change
    // by the rays per wanted side, W/m^2.
    void keepBalance(const std::vector<glm::vec3>& change, const FirstShot& shot,
                     Irradiance& light) const {
        glm::dvec3 made(0.0), changed(0.0), all(0.0);  // absorbed power, W
        for (size_t w = 0; w < wanted.size(); ++w) {
            const glm::dvec3 own = absorbing(wanted[w].side);
            made += own * glm::dvec3(change[w]);
            changed += own * glm::abs(glm::dvec3(change[w]));
        }
        for (uint32_t side = 0; side < light.ofSources.size(); ++side)
            all += absorbing(side) * glm::dvec3(light.all(side));
        glm::vec3 share(0.0f);
        for (int c = 0; c < 3; ++c)
            if (changed[c] > 0)
                share[c] =
                    float((made[c] - glm::clamp(made[c], -kMostMade * all[c], kMostMade * all[c])) /
                          changed[c]);
        if (share == glm::vec3(0.0f)) return;
        for (size_t w = 0; w < wanted.size(); ++w) {
            const uint32_t side = wanted[w].side;
            const glm::vec3 already = alreadyIndirect(shot, surfaces.exposed, side);
            const glm::vec3 now = broughtTo(side, light, already);
            glm::vec3 factor(1.0f);
            for (int c = 0; c < 3; ++c)
                if (now[c] > 0)
                    factor[c] = std::max(0.0f, 1 - share[c] * std::abs(change[w][c]) / now[c]);
            glm::vec3 &direct = light.direct[side], &indirect = light.indirect[side];
            direct = light.ofSources[side] + factor * (direct - light.ofSources[side]);
            indirect = already + factor * (indirect - already);
        }
    }

    const LitSurfaces surfaces;
    const std::vector<ExtraRays>& wanted;
    const Samples& samples;
    double linesMet = 0;  // number of lines that met the wanted sides
    // Per wanted side and light: sums for the joint estimate of both halves and for each half.
    std::vector<std::array<Brought, 3>> brought;
    // Per wanted side: number of rays of each half that are not left out.
    std::vector<std::array<float, 2>> counted;
    const size_t lightCount;
};

}  // namespace

void addExtraRays(const ExtraRaysInput& input, std::vector<std::array<float, 2>>& samples,
                  SetLights& lights, std::vector<std::array<Irradiance, 2>>& halves) {
    ExtraGather gather(input, samples, lights);
    {
        // All rays read the light as it was before any ray changed it.
        std::vector<Sent> sent;
        for (size_t k = 0; k < lights.size(); ++k) sent.emplace_back(input, lights[k], halves[k]);
        gather.cast(input, sent);
    }
    for (size_t k = 0; k < lights.size(); ++k) {
        gather.bring(k, 0, lights[k].shot, lights[k].irradiance);
        for (size_t h = 0; h < 2; ++h) gather.bring(k, 1 + h, lights[k].shot, halves[k][h]);
    }
    gather.count(samples);
}

}  // namespace raybundle
