// SPDX-License-Identifier: GPL-3.0-or-later
//
// Irradiance at few places of a surface, the records, from which it is interpolated elsewhere. The
// light of surfaces around and of the sky varies slowly over most surfaces, so that a dense mesh
// needs far fewer records than it has vertices.
//
// Sources: Ward, Rubinstein and Clear, "A Ray Tracing Solution for Diffuse Interreflection" (1988);
// Tabellion and Lamorlette, "An Approximate Global Illumination System for Computer Generated
// Films" (2004), for weights that end at a distance; Krivanek, Bouatouch, Pattanaik and Zara,
// "Making Radiance and Irradiance Caching Practical: Adaptive Caching and Neighbor Clamping" (2006)
// for records that become denser where their light disagrees.
// Differs:
// - A linear function of position and normal is fitted to the records around a place. The records
//   themselves have no gradients, whose noise would need more rays.
// - Each record is compared with what the other records predict for its place. Where the difference
//   is more than noise, records reach less far.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <unordered_map>
#include <vector>

namespace raybundle {

// A point of a surface. The point is in m, relative to Patches::centre; the normal is unit.
struct CachePlace {
    glm::vec3 position{0.0f}, normal{0.0f};
    // Mean of the inverse distances of the surfaces around, 1/m; 0 for directions without any.
    float nearness = 0;
};

// Irradiance that is interpolated, W/m^2, and its noise.
struct CachedLight {
    glm::vec3 carried{0.0f};      // from the world, and from emission that is not a source
    glm::vec3 reflected{0.0f};    // from other surfaces
    glm::vec3 surrounding{0.0f};  // from sources that surround the scene, as far as it is shown
    float open = 0;               // share of the surroundings without surfaces, 0 to 1
    double variance = 0;          // of total(), mean over the channels, (W/m^2)^2
    // What the variance must not exceed for the light to be good enough, (W/m^2)^2.
    double allowed = 0;

    glm::vec3 total() const { return carried + reflected + surrounding; }
    bool isGood() const { return variance <= allowed; }
};

// The records of one object and one light. Functions that are const may be called from several
// threads at once.
class IrradianceCache {
  public:
    // No record is used further away than `largestReach`, m.
    explicit IrradianceCache(float largestReach) : largestReach(largestReach) {}

    // Adds a record, which is used from the next update() on.
    void add(const CachePlace& place, const CachedLight& light);
    // Takes the records added since the last call into account. With `compares`, shortens the reach
    // of records around which others do not predict the light.
    void update(bool compares);

    // Returns the light at a place, or at a point off the place in its plane, m. Its variance is
    // infinite if no record reaches the place.
    CachedLight at(const CachePlace& place, const glm::vec3& off = glm::vec3(0.0f)) const {
        return interpolate(place, kNone, off);
    }

    size_t count() const { return records.size(); }
    // Returns whether any record but the first `before` ones reaches a place, so that they have
    // changed the light there.
    bool isReachedSince(size_t before, const CachePlace& place) const;

  private:
    static constexpr uint32_t kNone = UINT32_MAX;
    static constexpr int kLevels = 64;  // from -kLevels / 2 on
    struct Record {
        CachePlace place;
        CachedLight light;
        float reach = 0, angle = 0;  // m; as a distance of unit normals
    };
    // Cells of grids of all powers of two as widths, in which records are found.
    struct Cell {
        int level;
        glm::ivec3 at;
        bool operator==(const Cell& other) const { return level == other.level && at == other.at; }
    };
    struct CellHash {
        size_t operator()(const Cell& cell) const;
    };
    // A record as it is found in a cell, with all that its weight depends on.
    struct Found {
        glm::vec3 position, normal;
        float reach, angle;  // as in Record
        uint32_t record;
    };
    // Returns the light off a place from all records but one, or from all (kNone).
    CachedLight interpolate(const CachePlace& place, uint32_t without,
                            const glm::vec3& off = glm::vec3(0.0f)) const;
    // Returns the weight of a record at a place, 0 to 1. `ownReach` is reachOf(place).
    static float weightOf(const Found& record, const CachePlace& place, float ownReach);
    float reachOf(const CachePlace& place) const;
    // Calls visit(found, weight) for each record that reaches a place, except for the first
    // `before` records, until it returns false.
    template <class Visit>
    void forEachAround(const CachePlace& place, size_t before, const Visit& visit) const;
    glm::ivec3 cellAt(const glm::vec3& position, float width) const;
    void buildIndex();

    const float largestReach;
    std::vector<Record> records;
    std::unordered_map<Cell, std::vector<Found>, CellHash> cells;
    // Per cell of the largest level: bit k is set if any record is found inside of it in cells of
    // level k - kLevels / 2.
    std::unordered_map<Cell, uint64_t, CellHash> levelsIn;
    int largestLevel = 0;
};

}  // namespace raybundle
