// SPDX-License-Identifier: GPL-3.0-or-later
#include "lights/world_source.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <mutex>

#include "lights/receiver_place.h"
#include "sampling/hasher.h"
#include "sampling/sphere_sampling.h"

namespace raybundle {
namespace {

// A region has no children if it is flat (smaller than kFlatCell) and its radiance varies by less
// than kLeastVariation times the integral of the mean radiance over the sphere. The mean cosine of
// a flat region is wrong by about the square of its size, and only on a ring of this width around
// the horizon.
constexpr double kLeastVariation = 1e-4;
constexpr double kFlatCell = 0.12;  // radians

// The children of a flat region at the horizon are visited if its light times its reach exceeds
// this share of all light. Below this share, the children change the irradiance by less than 1e-4
// of it.
constexpr float kLeastCut = 1e-4f;

// Solid angle below which a region with children is a part of the source, sr. A sphere has some 500
// parts.
constexpr float kPartSolidAngle = 0.03f;

// Least share of its largest possible cosine that a region at the horizon is sampled with, so that
// each region with visible directions gets samples.
constexpr float kLeastAbove = 1e-3f;
// Reach of regions that are so large that no horizon leaves them whole.
constexpr float kMoreThanHalf = 2;

constexpr float kTouching = 1.01f;  // margin for rounding in the test of whether parts touch
constexpr float kBelowOne = 0.9999999f;
constexpr float kCover = 1.001f;  // radius of the disk that rays start from, in radii of the scene

float sum(const glm::vec3& v) { return v.x + v.y + v.z; }

// Returns the mean of max(0, s + a x + b y) over the square [-1, 1]^2.
double meanAbove(double s, double a, double b) {
    a = std::abs(a);
    b = std::abs(b);
    if (a < b) std::swap(a, b);
    if (s >= a + b) return s;
    if (s <= -a - b) return 0;
    auto power = [](double x, int n) { return x <= 0 ? 0 : n == 2 ? x * x : x * x * x; };
    if (b < 1e-3 * a) return power(s + a, 2) / (4 * a) - power(s - a, 2) / (4 * a);
    return (power(s + a + b, 3) - power(s + a - b, 3) - power(s - a + b, 3) + power(s - a - b, 3)) /
           (24 * a * b);
}

// Returns an image of the same light whose pixels are small enough to be flat.
WorldImage refined(const WorldImage& image) {
    const int across = int(std::ceil(glm::two_pi<double>() / kFlatCell / image.width)),
              up = int(std::ceil(glm::pi<double>() / kFlatCell / image.height));
    if (across <= 1 && up <= 1) return image;
    WorldImage fine{image.width * across, image.height * up, {}};
    fine.pixels.reserve(size_t(fine.width) * size_t(fine.height));
    for (int y = 0; y < fine.height; ++y)
        for (int x = 0; x < fine.width; ++x)
            fine.pixels.push_back(
                image.pixels[size_t(y / up) * size_t(image.width) + size_t(x / across)]);
    return fine;
}

}  // namespace

WorldSource::WorldSource(const WorldImage& given) : image(refined(given)) {
    Hasher hasher;
    hasher.add(given.width, given.height);
    hasher.add(given.pixels);
    shape = hasher.value();
    name = "the world";
    for (int y = 0; y <= image.height; ++y) {
        const double elevation = glm::pi<double>() * (double(y) / image.height - 0.5);
        height.push_back(std::sin(elevation));
        heightAngle.push_back(0.5 * elevation + 0.25 * std::sin(2 * elevation));
    }
    for (int x = 0; x <= image.width; ++x) {
        const double azimuth = glm::pi<double>() * (1 - 2.0 * x / image.width);
        cosine.push_back(std::cos(azimuth));
        sine.push_back(std::sin(azimuth));
    }
    leastVariation = float(kLeastVariation * 4 * glm::pi<double>()) * sum(image.meanRadiance());
    build(0, uint32_t(image.width), 0, uint32_t(image.height));
    regions.shrink_to_fit();
    lights.shrink_to_fit();
    leastCut = kLeastCut * regions[0].strength;
    findParts(0);
    findPartNeighbours();
}

bool WorldSource::isOf(const WorldImage& given) const {
    return image.width == given.width && image.height == given.height &&
           std::memcmp(image.pixels.data(), given.pixels.data(),
                       image.pixels.size() * sizeof(glm::vec3)) == 0;
}

void WorldSource::findParts(uint32_t index) {
    Region& region = regions[index];
    if (region.second == 0 || lights[index].solidAngle <= kPartSolidAngle) {
        region.part = int16_t(partRegions.size());
        partRegions.push_back(index);
        return;
    }
    findParts(index + 1);
    findParts(region.second);
}

void WorldSource::findPartNeighbours() {
    // If two regions touch, their middles are at most as far apart as both half diagonals together.
    auto halfDiagonal = [&](const Region& region) {
        return std::asin(std::min(region.reach, 1.0f));
    };
    partNeighbours.resize(partRegions.size());
    for (uint32_t a = 0; a < partRegions.size(); ++a)
        for (uint32_t b = a + 1; b < partRegions.size(); ++b) {
            const Region &one = regions[partRegions[a]], &other = regions[partRegions[b]];
            const float reach = kTouching * (halfDiagonal(one) + halfDiagonal(other));
            if (glm::dot(one.axis, other.axis) < std::cos(std::min(reach, glm::pi<float>())))
                continue;
            partNeighbours[a].push_back(b);
            partNeighbours[b].push_back(a);
        }
}

// Appends a region and all its descendants. The children are always built first, and removed again
// if their radiances differ little.
WorldSource::Extremes WorldSource::build(uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1) {
    const size_t index = regions.size();
    regions.emplace_back();
    lights.emplace_back();
    Region made;
    RegionLight light{x0, x1, y0, y1};
    measure(made, light);
    if (x1 - x0 == 1 && y1 - y0 == 1) {
        setPixel(made, light);
        regions[index] = made;
        lights[index] = light;
        const float value = light.solidAngle > 0 ? made.strength / light.solidAngle : 0;
        return {value, value};
    }
    // Cut across the longer edge.
    const double width = double(glm::length(made.half[0])),
                 height_ = double(glm::length(made.half[1]));
    made.cutsColumns = x1 - x0 > 1 && (y1 - y0 == 1 || width >= height_);
    const uint32_t x = (x0 + x1) / 2, y = (y0 + y1) / 2;
    const Extremes a = made.cutsColumns ? build(x0, x, y0, y1) : build(x0, x1, y0, y);
    made.second = uint32_t(regions.size());
    const Extremes b = made.cutsColumns ? build(x, x1, y0, y1) : build(x0, x1, y, y1);
    for (const size_t child : {index + 1, size_t(made.second)}) {
        made.strength += regions[child].strength;
        made.moment += regions[child].moment;
        light.flux += lights[child].flux;
        for (size_t c = 0; c < 3; ++c) light.moments[c] += lights[child].moments[c];
    }
    const Extremes both{std::min(a.least, b.least), std::max(a.most, b.most)};
    if ((isFlat(made) && (both.most - both.least) * light.solidAngle < leastVariation) ||
        both.most <= 0) {
        made.second = 0;
        regions.resize(index + 1);
        lights.resize(index + 1);
    }
    regions[index] = made;
    lights[index] = light;
    return both;
}

// Sets all members except the light.
void WorldSource::measure(Region& region, RegionLight& light) const {
    const double azimuth = glm::two_pi<double>() * (light.x1 - light.x0) / image.width;
    light.solidAngle = float(azimuth * (height[light.y1] - height[light.y0]));
    const double middle =
        glm::pi<double>() * (1 - (double(light.x0) + double(light.x1)) / image.width);
    const double low = glm::pi<double>() * (double(light.y0) / image.height - 0.5),
                 high = glm::pi<double>() * (double(light.y1) / image.height - 0.5);
    const double elevation = 0.5 * (low + high);
    auto towards = [](double phi, double e) {
        return glm::dvec3(std::cos(e) * std::cos(phi), std::cos(e) * std::sin(phi), std::sin(e));
    };
    const glm::dvec3 axis = towards(middle, elevation);
    region.axis = glm::vec3(axis);
    region.half[0] = glm::vec3(0.5 * azimuth * std::cos(elevation) *
                               glm::dvec3(-std::sin(middle), std::cos(middle), 0));
    region.half[1] =
        glm::vec3(0.5 * (high - low) *
                  glm::dvec3(-std::sin(elevation) * std::cos(middle),
                             -std::sin(elevation) * std::sin(middle), std::cos(elevation)));
    // The farthest directions from the axis are the corners, or lie where an edge is nearest to the
    // equator.
    double least = 1;
    const double equator = std::clamp(0.0, low, high);
    for (double e : {low, high, equator})
        least = std::min(least, glm::dot(axis, towards(middle + 0.5 * azimuth, e)));
    region.reach = azimuth > glm::pi<double>() || least <= 0
                       ? kMoreThanHalf
                       : float(std::sqrt(std::max(0.0, 1 - least * least)));
}

// Sets the light of a region of one pixel, whose radiance is constant.
void WorldSource::setPixel(Region& region, RegionLight& light) const {
    const uint32_t x = light.x0, y = light.y0;
    const glm::vec3& radiance = image.pixels[size_t(y) * size_t(image.width) + x];
    const double across = heightAngle[y + 1] - heightAngle[y];
    const double azimuth = glm::two_pi<double>() / image.width;
    // The azimuth decreases from column to column.
    const glm::dvec3 directions(
        across * (sine[x] - sine[x + 1]), across * (cosine[x + 1] - cosine[x]),
        0.5 * azimuth * (height[y + 1] * height[y + 1] - height[y] * height[y]));
    light.flux = radiance * light.solidAngle;
    region.strength = sum(light.flux);
    region.moment = glm::vec3(double(sum(radiance)) * directions);
    for (int c = 0; c < 3; ++c)
        light.moments[size_t(c)] = glm::vec3(double(radiance[c]) * directions);
}

template <class WeightOf>
WorldSource::Choice WorldSource::choose(uint32_t from, glm::vec2 uv, float probability,
                                        const WeightOf& weightOf) const {
    Choice choice{from, uv, probability, regions[from].part};
    while (const uint32_t second = regions[choice.region].second) {
        const uint32_t first = choice.region + 1;
        const float wa = weightOf(first), wb = weightOf(second);
        if (!(wa + wb > 0)) return {kNone, uv, 0, -1};
        const float p = wa / (wa + wb);
        float& u = regions[choice.region].cutsColumns ? choice.uv.x : choice.uv.y;
        const bool isFirst = u < p;
        u = std::min(isFirst ? u / p : (u - p) / (1 - p), kBelowOne);
        choice.probability *= isFirst ? p : 1 - p;
        choice.region = isFirst ? first : second;
        if (regions[choice.region].part >= 0) choice.part = regions[choice.region].part;
    }
    return choice;
}

// Chooses in proportion to radiance times cosine.
WorldSource::Choice WorldSource::chooseFacing(uint32_t from, glm::vec2 uv, float probability,
                                              const glm::vec3& normal) const {
    const Facing& facing = facingOf(normal);
    return choose(from, uv, probability, [&](uint32_t region) { return weightOf(region, facing); });
}

// Returns a direction that is uniform in the solid angle of the region.
glm::vec3 WorldSource::directionIn(const RegionLight& region, glm::vec2 uv) const {
    const double x = region.x0 + double(uv.x) * (region.x1 - region.x0);
    const double z = height[region.y0] + double(uv.y) * (height[region.y1] - height[region.y0]);
    const double azimuth = glm::pi<double>() * (1 - 2 * x / image.width);
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    return glm::vec3(r * std::cos(azimuth), r * std::sin(azimuth), z);
}

// The radiance is taken as constant in a region without children.
LightSample WorldSource::sampleOf(const Choice& choice, const glm::vec3& normal) const {
    LightSample sample;
    if (choice.region == kNone) return sample;
    const RegionLight& region = lights[choice.region];
    sample.distance = std::numeric_limits<float>::infinity();
    sample.direction = directionIn(region, choice.uv);
    sample.part = uint32_t(choice.part);
    const float c = std::max(0.0f, glm::dot(normal, sample.direction));
    sample.irradiance = region.flux * (c / choice.probability);
    return sample;
}

LightSample WorldSource::sample(const glm::vec3&, const glm::vec3& normal, glm::vec2 uv) const {
    return sampleOf(chooseFacing(0, uv, 1, normal), normal);
}

// look() would visit all regions at the horizon, of which the sample needs those on its way.
LightSample WorldSource::sampleAlone(const glm::vec3&, const glm::vec3& normal,
                                     glm::vec2 uv) const {
    return sampleOf(
        choose(0, uv, 1, [&](uint32_t region) { return weightOf(regions[region], normal); }),
        normal);
}

std::vector<float> WorldSource::sumOfSeen(const glm::vec3& normal,
                                          const std::vector<float>& seen) const {
    const Facing& facing = facingOf(normal);
    std::vector<float> sums(partRegions.size());
    float sum = 0;
    for (size_t k = 0; k < partRegions.size(); ++k) {
        sum += seen[k] * weightOf(partRegions[k], facing);
        sums[k] = sum;
    }
    return sums;
}

LightSample WorldSource::sampleSeen(const glm::vec3& normal, glm::vec2 uv,
                                    const std::vector<float>& sumOfSeen) const {
    const float all = sumOfSeen.back(), u = uv.x * all;
    const size_t part =
        size_t(std::upper_bound(sumOfSeen.begin(), sumOfSeen.end(), u) - sumOfSeen.begin());
    if (part >= partRegions.size()) return {};
    const float before = part > 0 ? sumOfSeen[part - 1] : 0, own = sumOfSeen[part] - before;
    uv.x = std::min((u - before) / own, kBelowOne);
    return sampleOf(chooseFacing(partRegions[part], uv, own / all, normal), normal);
}

float WorldSource::weightOf(uint32_t index, const Facing& facing) const {
    if (facing.weight[index] >= 0) return facing.weight[index];
    return weightOf(regions[index], facing.normal);
}

float WorldSource::weightOf(const Region& region, const glm::vec3& normal) {
    const float s = glm::dot(normal, region.axis), h = region.reach;
    if (!(region.strength > 0) || s <= -h) return 0;
    if (s >= h) return std::max(0.0f, glm::dot(normal, region.moment));
    // A curved piece may rise above a horizon that lies above the flat piece.
    return region.strength *
           std::max(meanCosine(region, normal), kLeastAbove * (s + h) * (s + h) / h);
}

bool WorldSource::isFlat(const Region& region) {
    const float longest = std::max(glm::dot(region.half[0], region.half[0]),
                                   glm::dot(region.half[1], region.half[1]));
    return 4 * double(longest) < kFlatCell * kFlatCell;
}

// Treats the region as a flat piece in the mean direction of its light.
float WorldSource::meanCosine(const Region& region, const glm::vec3& normal) {
    return float(meanAbove(double(glm::dot(normal, region.moment)) / double(region.strength),
                           double(glm::dot(normal, region.half[0])),
                           double(glm::dot(normal, region.half[1]))));
}

// Returns the irradiance from a region, W/m^2, and stores the weights of all visited regions.
glm::vec3 WorldSource::look(uint32_t index, Facing& facing) const {
    const Region& region = regions[index];
    const glm::vec3& normal = facing.normal;
    const float s = glm::dot(normal, region.axis), h = region.reach;
    facing.looked.push_back(index);
    float& weight = facing.weight[index];
    weight = 0;
    if (!(region.strength > 0) || s <= -h) return glm::vec3(0.0f);
    if (s >= h) {
        const auto& moments = lights[index].moments;
        weight = std::max(0.0f, glm::dot(normal, region.moment));
        return {glm::dot(normal, moments[0]), glm::dot(normal, moments[1]),
                glm::dot(normal, moments[2])};
    }
    if (region.second != 0 && (region.strength * h > leastCut || !isFlat(region))) {
        const glm::vec3 sum = look(index + 1, facing) + look(region.second, facing);
        weight = facing.weight[index + 1] + facing.weight[region.second];
        return sum;
    }
    weight = weightOf(region, normal);
    return lights[index].flux * meanCosine(region, normal);
}

const WorldSource::Facing& WorldSource::facingOf(const glm::vec3& normal) const {
    Facing& known = facing.local();
    if (known.normal != normal) {
        known.normal = normal;
        known.weight.resize(regions.size(), -1.0f);
        for (const uint32_t region : known.looked) known.weight[region] = -1;
        known.looked.clear();
        known.irradiance = glm::max(glm::vec3(0.0f), look(0, known));
    }
    return known;
}

std::optional<glm::vec3> WorldSource::irradiance(const glm::vec3&, const glm::vec3& normal) const {
    return facingOf(normal).irradiance;
}

bool WorldSource::isSeen(uint32_t index, const glm::vec3& normal) const {
    const Region& region = regions[index];
    const float s = glm::dot(normal, region.axis);
    if (!(region.strength > 0) || s <= -region.reach) return false;
    if (s >= region.reach || region.second == 0) return true;
    return isSeen(index + 1, normal) || isSeen(region.second, normal);
}

bool WorldSource::isOutOfSight(const ReceiverPlace& place) const {
    return !isSeen(0, place.normal);
}

float WorldSource::distance(const glm::vec3&) const {
    return std::numeric_limits<float>::infinity();
}

// Parallel rays of each direction start from a disk that covers the scene.
glm::vec3 WorldSource::shootingPower(float sceneRadius) const {
    const float r = kCover * sceneRadius;
    return lights[0].flux * (glm::pi<float>() * r * r);
}

EmittedRay WorldSource::emit(const glm::vec4& u, float sceneRadius) const {
    EmittedRay ray;
    const Choice choice =
        choose(0, {u.x, u.y}, 1, [&](uint32_t region) { return regions[region].strength; });
    const RegionLight& all = lights[0];
    const glm::vec3 towards = directionIn(lights[choice.region], choice.uv);
    const auto [x, y] = frame(towards);
    const glm::vec2 d = onDisk({u.z, u.w});
    ray.origin = kCover * sceneRadius * (towards + d.x * x + d.y * y);
    ray.direction = -towards;
    for (int c = 0; c < 3; ++c)
        ray.weight[c] = all.flux[c] > 0
                            ? lights[choice.region].flux[c] / (choice.probability * all.flux[c])
                            : 0;
    return ray;
}

std::shared_ptr<const WorldSource> worldSource(const WorldImage& image) {
    static std::mutex mutex;
    static std::weak_ptr<const WorldSource> last;
    const std::lock_guard lock(mutex);
    std::shared_ptr<const WorldSource> source = last.lock();
    if (!source || !source->isOf(image)) {
        source = std::make_shared<const WorldSource>(image);
        last = source;
    }
    return source;
}

}  // namespace raybundle
