// SPDX-License-Identifier: GPL-3.0-or-later
#include "first_shot/directed_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "bundles/directions.h"
#include "job/cancellation.h"
#include "patches/side.h"
#include "sampling/sobol.h"
#include "scene/channels.h"
#include "surfaces/side_reflectance.h"

namespace raybundle {
namespace {

// Directions within the angle of this cosine of their mean are merged into one.
constexpr float kSameDirection = 0.97f;
// In a scene of more sides than this each side keeps only one direction, since a lobe takes 80
// bytes.
constexpr size_t kManySides = size_t(1) << 18;
// Lobes that send less than this share of the arriving light are left out.
constexpr float kLeastShare = 1e-4f;
constexpr float kLeastReflectance = 1e-6f;
// Patches nearer to each other than kNear times their widths see each other in many directions.
// kNearPairs pairs of points represent these.
constexpr float kNear = 1.5f;
constexpr uint32_t kNearPairs = 8;
// Noise that directed light may add, relative to the noise of all reflected light.
constexpr double kNoiseShare = 0.5;
constexpr size_t kBlock = 256;  // sides per task

}  // namespace

DirectedLight::DirectedLight(const Patches& patches, const FirstShot& shot, Of of)
    : patches(patches) {
    if (patches.scattering.empty() && patches.byAngle.empty()) return;
    findMiddles();
    findLayers();
    if (patches.scattering.empty() || shot.incoming.empty() || of == Of::NOTHING) return;
    const size_t n = patches.sideCount(), blocks = (n + kBlock - 1) / kBlock;
    std::vector<std::vector<Part>> ofBlock(blocks);
    first.assign(n + 1, 0);
    parallelFor(size_t(0), blocks, [&](size_t block) {
        std::vector<Part>& parts = ofBlock[block];
        for (size_t side = block * kBlock; side < std::min(n, (block + 1) * kBlock); ++side) {
            const size_t before = parts.size();
            const bool isSentOn = of != Of::ALL && !shot.sentOn.empty() && shot.sentOn[side];
            if (!isSentOn) addParts(uint32_t(side), shot, parts);
            first[side + 1] = uint32_t(parts.size() - before);
        }
    });
    std::partial_sum(first.begin(), first.end(), first.begin());
    all.reserve(first.back());
    for (const std::vector<Part>& parts : ofBlock)
        all.insert(all.end(), parts.begin(), parts.end());
    if (isNone()) return;
    lineShare = enoughLines(shot);
}

void DirectedLight::findMiddles() {
    middles.resize(patches.count());
    parallelFor(size_t(0), middles.size(), [&](size_t p) {
        const bool isTriangle = patches.parents[patches.parentOf[p]].isTriangle;
        middles[p] = {patches.point(uint32_t(p), glm::vec2(isTriangle ? 1.0f / 3 : 0.5f)),
                      std::sqrt(patches.area[p])};
    });
}

void DirectedLight::findLayers() {
    if (std::none_of(patches.scattering.begin(), patches.scattering.end(),
                     [](const Scattering& surface) { return surface.hasLayer(); }))
        return;
    layers.resize(patches.sideCount());
    for (uint32_t side = 0; side < layers.size(); ++side) {
        const glm::vec3& all = patches.reflectance[side];
        if (!(brightest(all) > 0)) continue;
        const glm::vec3 diffuse = SideReflectance(patches, side).diffuseMean();
        layers[side] = {patches.normal(side), diffuse / glm::max(all, kLeastReflectance),
                        2 * patches.parentAt(side).scattering + isBack(side)};
    }
}

double DirectedLight::enoughLines(const FirstShot& shot) const {
    double reflected = 0, bent = 0;
    for (uint32_t side = 0; side < patches.sideCount(); ++side) {
        const double area = double(patches.area[patchOf(side)]);
        reflected += area * double(brightest(patches.reflectance[side] * shot.irradiance[side]));
        for (uint32_t k = first[side]; k < first[side + 1]; ++k)
            bent += area * double(all[k].lobe.contrast() * brightest(all[k].exitance));
    }
    return shareOfLines(bent, reflected);
}

double shareOfLines(double bent, double reflected) {
    if (!(bent > 0)) return 0;
    return std::min(1.0, std::pow(bent / (kNoiseShare * reflected), 1 / kNoiseSlope));
}

void DirectedLight::addParts(uint32_t side, const FirstShot& shot, std::vector<Part>& parts) const {
    const Parent& parent = patches.parentAt(side);
    const glm::vec3& light = shot.irradiance[side];
    if (!parent.exchanges || brightest(light) <= 0) return;
    const SideReflectance surface(patches, side);
    const Scattering& scattering = surface.scattering();
    if (scattering.isLambert()) return;
    const glm::vec3 f0 = surface.f0();
    const glm::vec3 normal = patches.normal(side);
    const Incoming& incoming = shot.incoming[side];
    std::array<glm::vec3, Incoming::kCount> directions;
    glm::vec3 mean(0.0f);
    for (size_t k = 0; k < directions.size(); ++k) mean += directions[k] = incoming.direction(k);
    const bool areOne =
        std::all_of(directions.begin(), directions.end(), [&](const glm::vec3& direction) {
            return glm::dot(direction, mean) > kSameDirection * glm::length(mean);
        });
    if (areOne) directions[0] = glm::normalize(mean);
    const size_t count = areOne || patches.sideCount() > kManySides ? 1 : directions.size();
    for (size_t k = 0; k < count; ++k) {
        const glm::vec3 direction = directions[k];
        const glm::vec3 part = incoming.weight / float(count) * light;
        const glm::vec4 terms = angleTerms(glm::dot(normal, direction));
        const glm::vec3 gloss = surface.mirroredAt(terms);
        if (brightest(gloss) > kLeastShare)
            parts.push_back({Lobe::gloss(normal, direction, scattering.glossMasking,
                                         scattering.glossRoughness, f0),
                             gloss * part});
        for (const LobeReflectance& lobe : scattering.lobes) {
            const glm::vec3 sent = surface.lobeAt(lobe, terms);
            if (brightest(sent) > kLeastShare)
                parts.push_back(
                    {Lobe::of(lobe.kind, normal, direction, lobe.roughness), sent * part});
        }
        if (!scattering.isRough()) continue;
        const glm::vec3 diffuse = surface.diffuseAt(terms);
        if (brightest(diffuse) > kLeastShare)
            parts.push_back({Lobe::diffuse(normal, direction, scattering.diffuseModel,
                                           scattering.diffuseRoughness),
                             diffuse * part});
    }
}

glm::vec3 DirectedLight::towards(uint32_t side, const glm::vec3& direction) const {
    glm::vec3 sum(0.0f);
    for (uint32_t k = first[side]; k < first[side + 1]; ++k)
        sum += (all[k].lobe.towards(direction) - 1.0f) * all[k].exitance;
    return sum;
}

glm::vec3 DirectedLight::layer(uint32_t side, const glm::vec3& direction) const {
    const Layer& layer = layers[side];
    return layer.diffuse * sumOfTerms(patches.scattering[layer.scattering].leaving,
                                      angleTerms(glm::dot(layer.normal, direction)) - kEverywhere);
}

glm::vec3 DirectedLight::beyondMean(uint32_t side, const glm::vec3& direction,
                                    const glm::vec3& mean) const {
    glm::vec3 more(0.0f);
    if (!isNone(side)) more += towards(side, direction);
    if (hasLayers()) more += layer(side, direction) * mean;
    return more;
}

bool DirectedLight::areNear(uint32_t side, uint32_t other) const {
    const glm::vec4 &from = middles[patchOf(side)], &to = middles[patchOf(other)];
    const glm::vec3 way = glm::vec3(to) - glm::vec3(from);
    const float near = kNear * (from.w + to.w);
    return glm::dot(way, way) < near * near;
}

glm::vec3 DirectedLight::middleWay(uint32_t side, uint32_t other) const {
    const glm::vec3 way = glm::vec3(middles[patchOf(other)]) - glm::vec3(middles[patchOf(side)]);
    const float square = glm::dot(way, way);
    return square > 0 ? way / std::sqrt(square) : patches.normal(side);
}

// Calls add(weight, direction) for pairs of points on both patches. The weight is the density of
// lines that join the two points.
template <class Add>
void DirectedLight::forNearWays(uint32_t side, uint32_t other, uint32_t random,
                                const Add& add) const {
    const glm::vec3 normal = patches.normal(side), otherNormal = patches.normal(other);
    const SobolPoints points(random);
    for (uint32_t k = 0; k < kNearPairs; ++k) {
        const glm::vec4 u = points[k];
        const glm::vec3 way =
            patches.point(patchOf(other), {u.z, u.w}) - patches.point(patchOf(side), {u.x, u.y});
        const float square = glm::dot(way, way);
        const float cosines = -glm::dot(normal, way) * glm::dot(otherNormal, way);
        if (!(square > 0) || glm::dot(normal, way) <= 0 || cosines <= 0) continue;
        add(cosines / (square * square), way / std::sqrt(square));
    }
}

glm::vec3 DirectedLight::wayBetween(uint32_t side, uint32_t other, uint32_t random) const {
    glm::vec3 chosen = middleWay(side, other);
    if (!areNear(side, other)) return chosen;
    float weights = 0;
    uint32_t draw = random;
    forNearWays(side, other, random, [&](float weight, const glm::vec3& way) {
        weights += weight;
        draw = hash(draw, 0);
        if (float(draw >> 8) * 0x1p-24f * weights < weight) chosen = way;
    });
    return chosen;
}

glm::vec3 DirectedLight::between(uint32_t side, uint32_t other, uint32_t random) const {
    if (!areNear(side, other)) return towards(side, middleWay(side, other));
    glm::vec3 sum(0.0f);
    float weights = 0;
    forNearWays(side, other, random, [&](float weight, const glm::vec3& way) {
        sum += weight * towards(side, way);
        weights += weight;
    });
    return weights > 0 ? sum / weights : glm::vec3(0.0f);
}

}  // namespace raybundle
