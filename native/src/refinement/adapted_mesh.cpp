// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/adapted_mesh.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <unordered_set>

#include "job/cancellation.h"
#include "patches/segment.h"
#include "sampling/sobol.h"
#include "scene/disjoint_sets.h"
#include "scene/rounded.h"

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
// The same on dense surfaces, where the light at corners shows jumps better than tiles do.
constexpr double kWorthPointsDense = 1;
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
// A line touches a tile, or the tiles beside it, if it is nearer to its centroid than this, in
// edges of a square with its area.
constexpr double kBesideLine = 2;
// Share of the squared unevenness that remains in the nearest continuous function. Measured in
// open_court: at a target of 2 %, the error was 3.7 % without unevenness, and is 1.9 % with it.
constexpr double kUneven = 0.5;
constexpr uint32_t kSeed = 0x5eed;
// Binary digits of errors: of triangles whose errors are equal but for rounding, the order decides
// which are refined.
constexpr int kErrorDigits = 10;

}  // namespace

double DiscontinuityLine::length() const {
    double sum = 0;
    for (size_t k = 1; k < points.size(); ++k) sum += glm::distance(points[k - 1], points[k]);
    return sum;
}

AdaptedMesh::AdaptedMesh(const KnownLight& known, uint32_t instance, const InstanceRange& range,
                         double meanSquare, const std::vector<DiscontinuityLine>& lines,
                         size_t mostVertices)
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
    refined.addLines({lines.begin(), lines.end()}, mostVertices);
    noteLines(lines);
    addTiles();
}

// The light of tiles on both sides of a line is a mean that shows neither, and the differences
// between tiles there show the jump.
void AdaptedMesh::noteLines(const std::vector<DiscontinuityLine>& lines) {
    isMixed.resize(light.tileCount(), 0);
    for (const DiscontinuityLine& line : lines) {
        FaceLines& all = linesOf[line.face];
        all.reach = std::max({all.reach, line.accuracy, 0.5 * line.width});
        all.jump = std::max(all.jump, line.jump);
        const auto [begin, end] = light.tilesOf(line.face);
        parallelFor(begin, end, [&, &points = line.points](uint32_t tile) {
            const glm::dvec3& place = light.tile(tile).centroid;
            const double reach = kBesideLine * std::sqrt(light.tile(tile).area);
            for (size_t k = 1; k < points.size() && !isMixed[tile]; ++k)
                isMixed[tile] = distanceToSegment(place, points[k - 1], points[k]) < reach;
        });
    }
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
                    return refined.smallestShare(triangles[a], place) <
                           refined.smallestShare(triangles[b], place);
                });
            refined.addPoint(inside, place);
            samples.push_back(isMixed[tile] ? FaceSample() : light.tile(tile).sample);
            tileOfPoint.push_back(tile);
        }
    }
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

void AdaptedMesh::addMixedTiles(std::vector<LightQuery>& queries) const {
    for (uint32_t point = 0; point < tileOfPoint.size(); ++point) {
        const uint32_t tile = tileOfPoint[point];
        if (!isMixed[tile]) continue;
        const glm::dvec3& place = refined.point(point);
        queries.push_back({tile, point, light.receiver(tile, place, hash(point, kSeed))});
    }
}

std::vector<uint32_t> AdaptedMesh::measure() {
    const size_t begin = errors.size();
    errors.resize(refined.triangles().size(), 0.0);
    fits.resize(errors.size());
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
            if (std::isfinite(more) && !isMixed[tileOfPoint[p]])
                beyond += double(samples[p].weight) * more;
            area += double(samples[p].weight);
        }
    }
    if (pointCount >= kEnoughPoints) {
        measureAtPoints(index);
        return false;
    }
    if (tiles.size() >= kEnoughTiles) {
        fits[index] = fit(triangle, tiles);
        errors[index] = beyond + area * fits[index].meanSquare;
        return false;
    }
    if (pointCount > 0) return true;
    const auto tile = light.tileAt(triangle.face, middle(triangle));
    if (!tile) return false;
    // Infinite if it is not known.
    const double here = isMixed[*tile] ? INFINITY : double(light.tile(*tile).beyond);
    fits[index] = fit(triangle, tiles);
    const double mean = (area > 0 ? std::max(beyond / area, here) : here) + fits[index].meanSquare;
    const double worth = light.isDense(triangle.face) ? kWorthPointsDense : kWorthPoints;
    if (mean > worth * std::min(ofScene, ofObject)) return true;
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
        // Where a line is misplaced, the point lies on the wrong side of it, and has no weight.
        if (isBesideLine(refined.triangles()[triangle], place)) continue;
        if (const auto tile = light.tileAt(face, place))
            queries.push_back({*tile, point, light.receiver(*tile, place, hash(point, kSeed))});
    }
}

bool AdaptedMesh::isBesideLine(const RefinedMesh::Triangle& triangle,
                               const glm::dvec3& point) const {
    const auto found = linesOf.find(triangle.face);
    if (found == linesOf.end()) return false;
    for (size_t k = 0; k < 3; ++k)
        if (triangle.isAbrupt[k] &&
            distanceToSegment(point, refined.position(triangle, k),
                              refined.position(triangle, (k + 1) % 3)) < found->second.reach)
            return true;
    return false;
}

double AdaptedMesh::meanSquareError(uint32_t triangle) const {
    const double area = refined.area(refined.triangles()[triangle]);
    return area > 0 ? errors[triangle] / area : 0;
}

void AdaptedMesh::setLight(const LightQuery& query, const glm::vec3& ofSources, float variance) {
    const glm::dvec3& place = refined.point(query.point);
    FaceSample& sample = samples[query.point];
    if (query.receiver)
        sample = light.at(query.tile, place, ofSources, variance);
    else if (light.isTranslucent(query.tile))
        sample = light.at(query.tile, place, {}, 0);
    // Otherwise another surface covers the point, which then has no weight.
    if (query.point < tileOfPoint.size()) sample.weight *= light.tile(query.tile).sample.weight;
}

void AdaptedMesh::measureAtPoints(uint32_t index) {
    const RefinedMesh::Triangle& triangle = refined.triangles()[index];
    std::vector<uint32_t> points;
    size_t count = 0;
    for (uint32_t p : triangle.points) {
        if (p < tileOfPoint.size()) continue;
        ++count;
        if (samples[p].weight > 0) points.push_back(p);
    }
    if (count == 0) return;
    fits[index] = fit(triangle, points);
    errors[index] =
        refined.area(triangle) * double(points.size()) / double(count) * fits[index].meanSquare;
}

AdaptedMesh::Fit AdaptedMesh::fit(const RefinedMesh::Triangle& triangle,
                                  const std::vector<uint32_t>& these) const {
    const glm::dvec3& a = refined.position(triangle, 0);
    const glm::dvec3 u = refined.position(triangle, 1) - a, v = refined.position(triangle, 2) - a;
    const glm::dvec3 normal = glm::cross(u, v);
    const double scale = glm::dot(normal, normal);
    if (!(scale > 0) || these.size() <= kUnknowns) return {};
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
    const glm::dmat3 inverse = glm::inverse(matrix), fit = right * inverse;
    double squares = 0;
    for (uint32_t p : these) {
        const glm::dvec3 off = glm::dvec3(samples[p].light) - fit * basis(p);
        squares += double(samples[p].weight) * glm::dot(off, off);
    }
    // The fit follows a part of the differences.
    const double unfitted = double(these.size() - kUnknowns) / double(these.size());
    Fit result{std::max(0.0, squares / unfitted - noise) / weights, true};
    for (int k = 0; k < 3; ++k) {
        const glm::dvec3 at(1, k == 1 ? 2.0 / 3 : -1.0 / 3, k == 2 ? 2.0 / 3 : -1.0 / 3);
        result.corner[size_t(k)] = glm::vec3(fit * at);
        result.variance += noise / double(these.size()) * glm::dot(at, inverse * at) / 3;
    }
    return result;
}

// A line ends where only one of its edges meets a vertex within a face. On the edges of a face, it
// goes on beyond the edge, or the light is not continuous there.
std::vector<uint8_t> AdaptedMesh::lineEnds() const {
    const auto& triangles = refined.triangles();
    std::vector<uint8_t> ends(triangles.size(), 0);
    if (linesOf.empty()) return ends;
    std::unordered_map<uint32_t, int> edgesAt;  // per place with lines: twice the number of edges
    std::unordered_set<uint32_t> atBorder;      // places on edges of the source
    for (const RefinedMesh::Triangle& one : triangles) {
        if (!one.isAlive) continue;
        for (size_t k = 0; k < 3; ++k)
            for (const uint32_t place : {one.place[k], one.place[(k + 1) % 3]}) {
                if (one.isAbrupt[k]) ++edgesAt[place];
                if (one.sourceEdge[k] >= 0) atBorder.insert(place);
            }
    }
    for (size_t t = 0; t < triangles.size(); ++t) {
        if (!triangles[t].isAlive) continue;
        for (const uint32_t place : triangles[t].place) {
            const auto found = edgesAt.find(place);
            ends[t] += found != edgesAt.end() && found->second <= 2 && !atBorder.count(place);
        }
    }
    return ends;
}

// The shown light at a vertex is nearly the mean of the light that the triangles around it want
// there. Triangles of different faces are not compared, as light depends on their normals.
std::vector<double> AdaptedMesh::unevenness() const {
    const auto& triangles = refined.triangles();
    DisjointSets nodes(3 * triangles.size());
    for (uint32_t t = 0; t < triangles.size(); ++t) {
        if (!triangles[t].isAlive) continue;
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t other = triangles[t].ring[k], u = other / 3, j = other % 3;
            if (u <= t || RefinedMesh::isFixed(triangles[t], k) ||
                triangles[u].face != triangles[t].face)
                continue;
            for (const uint32_t a : {k, (k + 1) % 3})
                for (const uint32_t b : {j, (j + 1) % 3})
                    if (triangles[t].place[a] == triangles[u].place[b])
                        nodes.join(3 * t + a, 3 * u + b);
        }
    }
    struct Sum {
        glm::dvec3 light{0.0};
        double area = 0;
    };
    std::vector<Sum> sums(3 * triangles.size());
    for (uint32_t t = 0; t < triangles.size(); ++t) {
        if (!triangles[t].isAlive || !fits[t].isKnown) continue;
        const double area = refined.area(triangles[t]);
        for (uint32_t k = 0; k < 3; ++k) {
            Sum& sum = sums[nodes.root(3 * t + k)];
            sum.light += area * glm::dvec3(fits[t].corner[k]);
            sum.area += area;
        }
    }
    std::vector<double> result(triangles.size(), 0.0);
    for (uint32_t t = 0; t < triangles.size(); ++t) {
        if (!triangles[t].isAlive || !fits[t].isKnown) continue;
        std::array<glm::dvec3, 3> off;
        for (uint32_t k = 0; k < 3; ++k) {
            const Sum& sum = sums[nodes.root(3 * t + k)];
            off[k] = sum.light / sum.area - glm::dvec3(fits[t].corner[k]);
        }
        // The integral of the square of a linear function.
        const glm::dvec3 all = off[0] + off[1] + off[2];
        const double square = (glm::dot(off[0], off[0]) + glm::dot(off[1], off[1]) +
                               glm::dot(off[2], off[2]) + glm::dot(all, all)) /
                              12;
        result[t] = refined.area(triangles[t]) * std::max(0.0, square - fits[t].variance);
    }
    return result;
}

double AdaptedMesh::addErrors(uint32_t index, std::vector<TriangleError>& result) const {
    if (!(ofScene > 0)) return 0;
    double sum = 0;
    const std::vector<uint8_t> ends = lineEnds();
    const std::vector<double> uneven = unevenness();
    for (uint32_t t = 0; t < errors.size(); ++t) {
        const RefinedMesh::Triangle& triangle = refined.triangles()[t];
        if (!triangle.isAlive) continue;
        double error = std::max(kContinuous * errors[t], errors[t] + kUneven * uneven[t]);
        // At the end of a line, both sides of it share a value, which is half the jump off on each
        // side. This difference falls linearly to the opposite edge.
        if (ends[t] > 0)
            error += ends[t] * refined.area(triangle) / 6 *
                     std::pow(0.5 * linesOf.at(triangle.face).jump, 2);
        if (!(error > 0)) continue;
        result.push_back({rounded(error / ofScene, kErrorDigits), index, t});
        sum += result.back().square;
    }
    return sum;
}

}  // namespace raybundle
