// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/adapted_mesh.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "job/cancellation.h"
#include "sampling/sobol.h"

namespace raybundle {
namespace {

// Number of tiles, or of points, in a triangle that show how its light differs from a linear
// function.
constexpr size_t kEnoughTiles = 12, kEnoughPoints = 10;
// Unknowns of a linear function in a plane.
constexpr size_t kUnknowns = 3;
// A triangle is sampled at points if the mean square error that tiles expect in it is above this
// share of that which is allowed.
constexpr double kWorthPoints = 0.1;
// Mean square difference of the nearest continuous function of linear pieces from the light,
// relative to that of the nearest function in each triangle alone. Measured: 1.4 to 2.9 where light
// is smooth, 3.5 at the edge of a hard shadow.
constexpr double kContinuous = 4;
// The error of an object that is allowed, in targets of the scene.
constexpr double kOfObject = 2.5;
// Objects with less than this share of the mean square light of the scene are judged as if they had
// as much.
constexpr double kDark = 0.01;
// No triangle is divided whose longest edge is shorter than this share of that of its tile.
constexpr double kFinest = 1.0 / 64;
constexpr uint32_t kSeed = 0x5eed;

// Returns a value with ten binary digits. Of triangles whose errors are equal but for rounding, as
// in symmetric scenes, the order then decides which are refined, and not the rounding.
double rounded(double value) {
    int exponent = 0;
    const double digits = std::frexp(value, &exponent);
    return std::ldexp(std::round(std::ldexp(digits, 10)), exponent - 10);
}

}  // namespace

AdaptedMesh::AdaptedMesh(const KnownLight& known, uint32_t instance, const InstanceRange& range,
                         double meanSquare)
    : light(known, instance, range),
      refined(known.scene.meshes[size_t(known.scene.instances[instance].mesh)],
              glm::translate(glm::dmat4(1.0), -known.patches.centre) *
                  known.scene.instances[instance].transform) {
    const double area = light.exposedArea();
    const double target =
        double(known.scene.instances[instance].noiseFactor * known.settings.targetError);
    if (area > 0) {
        ofScene = std::pow(target, 2) * meanSquare;
        ofObject =
            std::pow(kOfObject * target, 2) * std::max(light.signal() / area, kDark * meanSquare);
    }
    addTiles();
}

// Puts the centroids of all tiles into the triangles of their faces.
void AdaptedMesh::addTiles() {
    const auto& triangles = refined.triangles();
    std::vector<std::vector<uint32_t>> ofFace(light.faceCount());
    for (uint32_t t = 0; t < triangles.size(); ++t)
        if (triangles[t].isAlive) ofFace[size_t(triangles[t].face)].push_back(t);
    for (size_t f = 0; f < ofFace.size(); ++f) {
        throwIfCancelledAt(f);
        if (ofFace[f].empty()) continue;
        const auto [begin, end] = light.tilesOf(int32_t(f));
        for (uint32_t tile = begin; tile < end; ++tile) {
            const glm::dvec3& place = light.tile(tile).centroid;
            const uint32_t inside =
                *std::max_element(ofFace[f].begin(), ofFace[f].end(), [&](uint32_t a, uint32_t b) {
                    return smallestShare(triangles[a], place) < smallestShare(triangles[b], place);
                });
            refined.addPoint(inside, place);
            samples.push_back(light.tile(tile).sample);
            tileOfPoint.push_back(tile);
        }
    }
}

// The smallest barycentric coordinate of a point in a triangle.
double AdaptedMesh::smallestShare(const RefinedMesh::Triangle& triangle,
                                  const glm::dvec3& place) const {
    const glm::dvec3 &a = refined.position(triangle, 0), &b = refined.position(triangle, 1),
                     &c = refined.position(triangle, 2);
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double scale = glm::dot(normal, normal);
    if (!(scale > 0)) return -INFINITY;
    return std::min({glm::dot(normal, glm::cross(b - a, place - a)),
                     glm::dot(normal, glm::cross(c - b, place - b)),
                     glm::dot(normal, glm::cross(a - c, place - c))}) /
           scale;
}

glm::dvec3 AdaptedMesh::middle(const RefinedMesh::Triangle& triangle) const {
    return (refined.position(triangle, 0) + refined.position(triangle, 1) +
            refined.position(triangle, 2)) /
           3.0;
}

bool AdaptedMesh::isDivisible(uint32_t triangle) const {
    const RefinedMesh::Triangle& one = refined.triangles()[triangle];
    const auto tile = light.tileAt(one.face, middle(one));
    return tile && refined.longestEdge(one) > kFinest * std::sqrt(light.tile(*tile).area);
}

std::vector<uint32_t> AdaptedMesh::measure() {
    const size_t begin = errors.size();
    errors.resize(refined.triangles().size(), 0.0);
    std::vector<uint8_t> wants(errors.size() - begin, 0);
    parallelFor(begin, errors.size(),
                [&](size_t t) { wants[t - begin] = measureAtTiles(uint32_t(t)); });
    std::vector<uint32_t> wanting;
    for (size_t t = begin; t < errors.size(); ++t)
        if (wants[t - begin]) wanting.push_back(uint32_t(t));
    return wanting;
}

bool AdaptedMesh::measureAtTiles(uint32_t index) {
    const RefinedMesh::Triangle& triangle = refined.triangles()[index];
    if (!triangle.isAlive || !(ofScene > 0)) return false;
    std::vector<uint32_t> tiles;
    size_t pointCount = 0;
    double beyond = 0, area = 0;
    for (uint32_t p : triangle.points) {
        if (p >= tileOfPoint.size()) {
            ++pointCount;
        } else if (samples[p].weight > 0) {
            tiles.push_back(p);
            const double more = double(light.tile(tileOfPoint[p]).beyond);
            // In a triangle with enough tiles, those that do not say have neighbours that do.
            if (std::isfinite(more)) beyond += double(samples[p].weight) * more;
            area += double(samples[p].weight);
        }
    }
    if (pointCount >= kEnoughPoints) {
        errors[index] = errorAtPoints(index);
        return false;
    }
    if (tiles.size() >= kEnoughTiles) {
        errors[index] = beyond + area * fitError(triangle, tiles);
        return false;
    }
    if (pointCount > 0) return true;
    const auto tile = light.tileAt(triangle.face, middle(triangle));
    if (!tile) return false;
    // Infinite if it is not known.
    const double here = double(light.tile(*tile).beyond);
    const double mean =
        (area > 0 ? std::max(beyond / area, here) : here) + fitError(triangle, tiles);
    if (mean > kWorthPoints * std::min(ofScene, ofObject)) return true;
    errors[index] = refined.area(triangle) * mean;
    return false;
}

void AdaptedMesh::addPoints(uint32_t triangle, std::vector<LightQuery>& queries) {
    const RefinedMesh::Triangle& one = refined.triangles()[triangle];
    const size_t has = size_t(std::count_if(one.points.begin(), one.points.end(),
                                            [&](uint32_t p) { return p >= tileOfPoint.size(); }));
    const int32_t face = one.face;
    const glm::dvec3 a = refined.position(one, 0), b = refined.position(one, 1),
                     c = refined.position(one, 2);
    for (size_t k = has; k < kEnoughPoints; ++k) {
        const glm::vec4 u = sobolPoint(uint32_t(k), hash(kSeed, triangle));
        const double root = std::sqrt(double(u.x)), v = double(u.y);
        const glm::dvec3 place = (1 - root) * a + root * (1 - v) * b + root * v * c;
        const uint32_t point = refined.addPoint(triangle, place);
        samples.emplace_back();
        if (const auto tile = light.tileAt(face, place))
            queries.push_back({*tile, point, light.receiver(*tile, place, hash(point, kSeed))});
    }
}

void AdaptedMesh::setLight(const LightQuery& query, const glm::vec3& ofSources, float variance) {
    const glm::dvec3& place = refined.point(query.point);
    if (query.receiver)
        samples[query.point] = light.at(query.tile, place, ofSources, variance);
    else if (light.isTranslucent(query.tile))
        samples[query.point] = light.at(query.tile, place, {}, 0);
    // Otherwise another surface covers the point, which then has no weight.
}

double AdaptedMesh::errorAtPoints(uint32_t index) const {
    const RefinedMesh::Triangle& triangle = refined.triangles()[index];
    std::vector<uint32_t> points;
    size_t count = 0;
    for (uint32_t p : triangle.points) {
        if (p < tileOfPoint.size()) continue;
        ++count;
        if (samples[p].weight > 0) points.push_back(p);
    }
    if (count == 0) return 0;
    return refined.area(triangle) * double(points.size()) / double(count) *
           fitError(triangle, points);
}

double AdaptedMesh::fitError(const RefinedMesh::Triangle& triangle,
                             const std::vector<uint32_t>& these) const {
    const glm::dvec3& a = refined.position(triangle, 0);
    const glm::dvec3 u = refined.position(triangle, 1) - a, v = refined.position(triangle, 2) - a;
    const glm::dvec3 normal = glm::cross(u, v);
    const double scale = glm::dot(normal, normal);
    if (!(scale > 0) || these.size() <= kUnknowns) return 0;
    auto basis = [&](uint32_t p) {
        const glm::dvec3 d = refined.point(p) - a;
        // Centred at the centroid, so that the matrix is well conditioned.
        return glm::dvec3(1, glm::dot(normal, glm::cross(d, v)) / scale - 1.0 / 3,
                          glm::dot(normal, glm::cross(u, d)) / scale - 1.0 / 3);
    };
    glm::dmat3 matrix(0.0), right(0.0);
    double weights = 0, noise = 0;
    for (uint32_t p : these) {
        const double weight = double(samples[p].weight);
        const glm::dvec3 at = basis(p);
        matrix += weight * glm::outerProduct(at, at);
        right += weight * glm::outerProduct(glm::dvec3(samples[p].light), at);
        weights += weight;
        noise += weight * double(samples[p].variance);
    }
    // If all samples lie on one line, this chooses the smallest slope.
    matrix[1][1] += 1e-9 * weights;
    matrix[2][2] += 1e-9 * weights;
    const glm::dmat3 fit = right * glm::inverse(matrix);
    double squares = 0;
    for (uint32_t p : these) {
        const glm::dvec3 off = glm::dvec3(samples[p].light) - fit * basis(p);
        squares += double(samples[p].weight) * glm::dot(off, off);
    }
    // The fit follows a part of the differences.
    const double unfitted = double(these.size() - kUnknowns) / double(these.size());
    return std::max(0.0, squares / unfitted - noise) / weights;
}

double AdaptedMesh::addErrors(uint32_t index, std::vector<TriangleError>& result) const {
    if (!(ofScene > 0)) return 0;
    double sum = 0;
    for (uint32_t t = 0; t < errors.size(); ++t) {
        if (!refined.triangles()[t].isAlive || !(errors[t] > 0)) continue;
        result.push_back({rounded(kContinuous * errors[t] / ofScene), index, t});
        sum += result.back().square;
    }
    return sum;
}

}  // namespace raybundle
