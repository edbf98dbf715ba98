// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/face_light.h"

#include <array>
#include <cmath>

#include "job/cancellation.h"
#include "patches/neighbours.h"
#include "patches/side.h"
#include "stated_error/dense_surplus.h"
#include "visibility/local_lines.h"

namespace raybundle {
namespace {

// A side whose exposed share is smaller has no light that continues to its neighbours.
constexpr float kHalfCovered = 0.5f;

float squareOf(const glm::vec3& v) { return glm::dot(v, v); }

}  // namespace

FaceLight::FaceLight(const KnownLight& known, uint32_t index, const InstanceRange& range)
    : known(known), instance(known.scene.instances[index]) {
    const Patches& patches = known.tiles.patches();
    const SideErrors& sides = known.sides;
    const size_t faceCount = known.scene.meshes[size_t(instance.mesh)].faceCount();
    if (range.firstParent < range.lastParent)
        firstTile = patches.parents[range.firstParent].firstTile;
    const std::vector<Surplus> surplus =
        surplusOf({patches, sides.exposed}, range.firstParent, range.lastParent, instance.side,
                  sides.irradiance, sides.directError);
    std::vector<float> ofDense;
    if (known.light[index].gatheredNoise)
        ofDense = denseSurplus(patches, range.firstParent, range.lastParent, instance.side,
                               sides.isGathered, known.light[index]);
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
        throwIfCancelledAt(p);
        const Parent& parent = patches.parents[p];
        firstOfFace.resize(size_t(parent.face) + 1, uint32_t(tiles.size()));
        const glm::vec2 middle = parent.isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f);
        for (uint32_t k = 0; k < parent.patchCount(); ++k) {
            Tile tile;
            tile.side = sideOf(parent.firstPatch + k, instance.side == RB_SIDE_BACK);
            tile.centroid = parent.position(parent.pointOn(k, middle));
            tile.area = double(patches.area[patchOf(tile.side)]);
            const float share = sides.exposed[tile.side];
            tile.sample.light = sides.irradiance.all(tile.side);
            if (!sides.noise.empty())
                tile.sample.variance = squareOf(sides.noise[tile.side]) +
                                       3 * std::pow(sides.directError[tile.side], 2.0f);
            tile.sample.weight = share > kHalfCovered ? float(tile.area) * share : 0.0f;
            const Surplus& more = surplus[tiles.size()];
            tile.isDense = known.shown.isGatheredAtNodes(known.tiles.firstSide(tile.side));
            if (tile.isDense)
                tile.beyond = ofDense[tiles.size()];
            else if (more.isKnown)
                tile.beyond = more.smooth + std::max(more.step, 0.0f);
            area += double(tile.sample.weight);
            squares += double(tile.sample.weight * squareOf(tile.sample.light));
            tiles.push_back(tile);
            parentOf.push_back(p);
        }
    }
    firstOfFace.resize(faceCount + 1, uint32_t(tiles.size()));
    findSlopes(range);
}

void FaceLight::findSlopes(const InstanceRange& range) {
    const Patches& patches = known.tiles.patches();
    const SideErrors& sides = known.sides;
    auto others = [&](const Tile& tile) {
        return tile.sample.light - sides.irradiance.ofSources[tile.side];
    };
    // Per tile, the normal equations of the slope in the plane of the tile.
    struct Sums {
        glm::dmat3 places{0.0}, light{0.0};
    };
    std::vector<Sums> sums(tiles.size());
    for (const TilePair& pair : neighbouringTiles(patches, range.firstParent, range.lastParent)) {
        const uint32_t a = pair.first - firstTile, b = pair.second - firstTile;
        if (!(tiles[a].sample.weight > 0) || !(tiles[b].sample.weight > 0)) continue;
        const glm::dvec3 change(others(tiles[b]) - others(tiles[a]));
        const glm::dvec3 along = tiles[b].centroid - tiles[a].centroid;
        for (uint32_t tile : {a, b}) {
            const glm::dvec3 normal(patches.parents[parentOf[tile]].normal);
            const glm::dvec3 step = along - glm::dot(along, normal) * normal;
            sums[tile].places += glm::outerProduct(step, step);
            sums[tile].light += glm::outerProduct(change, step);
        }
    }
    slopes.resize(tiles.size(), glm::mat3(0.0f));
    for (size_t tile = 0; tile < tiles.size(); ++tile) {
        // The normal's own square makes the matrix regular. A tile whose neighbours lie on one line
        // has a slope along this line alone.
        const glm::dvec3 normal(patches.parents[parentOf[tile]].normal);
        const double size =
            sums[tile].places[0][0] + sums[tile].places[1][1] + sums[tile].places[2][2];
        if (!(size > 0)) continue;
        const glm::dmat3 matrix = sums[tile].places + size * glm::outerProduct(normal, normal) +
                                  1e-3 * size * glm::dmat3(1.0);
        slopes[tile] = glm::mat3(sums[tile].light * glm::inverse(matrix));
    }
}

std::optional<uint32_t> FaceLight::tileAt(int32_t face, const glm::dvec3& point) const {
    const Patches& patches = known.tiles.patches();
    const auto [begin, end] = tilesOf(face);
    std::optional<uint32_t> found;
    float nearest = INFINITY;
    for (uint32_t tile = begin; tile < end;) {
        const Parent& parent = patches.parents[parentOf[tile]];
        const glm::vec2 st = parent.affineAt(point);
        const float off = parent.outside(st);
        if (off < nearest) {
            nearest = off;
            found = tile + parent.patchAt(st.x, st.y);
        }
        tile += parent.patchCount();
    }
    return found;
}

bool FaceLight::isOn(int32_t face, const glm::dvec3& point) const {
    const Patches& patches = known.tiles.patches();
    const auto [begin, end] = tilesOf(face);
    for (uint32_t tile = begin; tile < end;) {
        const Parent& parent = patches.parents[parentOf[tile]];
        if (parent.outside(parent.affineAt(point)) <= 0) return true;
        tile += parent.patchCount();
    }
    return false;
}

std::optional<glm::dvec3> FaceLight::normal(int32_t face) const {
    const auto [begin, end] = tilesOf(face);
    if (begin == end) return {};
    return glm::dvec3(known.tiles.patches().parents[parentOf[begin]].normal);
}

std::optional<Receiver> FaceLight::receiver(uint32_t tile, const glm::dvec3& point,
                                            uint32_t seed) const {
    const Patches& patches = known.patches;
    Receiver receiver;
    receiver.point = glm::vec3(point);
    receiver.side =
        sideOf(patches.patchAt(parentOf[tile], *receiver.point), instance.side == RB_SIDE_BACK);
    if (!known.shown.isOwnAlone(receiver.side)) return {};
    receiver.normal = patches.normal(receiver.side);
    receiver.targetFactor = instance.noiseFactor;
    receiver.seed = seed;
    float distance = 0;
    const auto met =
        known.visibility.firstHit(receiver.side, *receiver.point, receiver.normal, &distance,
                                  2 * patches.islandAt(receiver.side).touchDistance);
    if (met && isCovered(patches, receiver.side, *met, receiver.normal, distance)) return {};
    return receiver;
}

FaceSample FaceLight::at(uint32_t index, const glm::dvec3& point,
                         const std::optional<glm::vec3>& ofSources, float variance) const {
    const Tile& tile = tiles[index];
    const glm::vec3 ofTile = known.sides.irradiance.ofSources[tile.side];
    const glm::vec3 others =
        tile.sample.light - ofTile + slopes[index] * glm::vec3(point - tile.centroid);
    // The noise of the other light is nearly the same at all points near each other.
    return {others + ofSources.value_or(ofTile), 3 * variance, 1};
}

}  // namespace raybundle
