// SPDX-License-Identifier: GPL-3.0-or-later
//
// The light on the faces of one instance at any point: what the patches know of it, and samples of
// the light of the sources where shadows and lamps make it change within a patch.
//
// Source: none; the thesis has one value per patch.
// - The light of the sources at a point is gathered by shadow rays from the point.
// - All other light is that of the patch, with the slope of the linear function that is nearest to
//   the light of the patches around it.
// - On translucent surfaces, all light is that of the patches.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "lights/receiver.h"
#include "patches/tiles.h"
#include "reconstruction/corner_weights.h"
#include "reconstruction/reconstruction_input.h"
#include "stated_error/stated_error.h"
#include "stated_error/surplus.h"

namespace raybundle {

// What the light on faces is known from. All references must outlive the object.
struct KnownLight : ReconstructionInput {
    const Tiles& tiles;
    const SideErrors& sides;                  // the shown light of the tiles, and its errors
    const std::vector<InstanceLight>& light;  // per instance, at corners
};

// The light at a point, or on a tile whose centroid is the point.
struct FaceSample {
    glm::vec3 light{0.0f};  // shown irradiance, W/m^2
    float variance = 0;     // of its noise, summed over RGB, (W/m^2)^2
    float weight = 0;       // m^2 of a tile, 1 for a point; 0 where another surface covers it
};

class FaceLight {
  public:
    // `range` holds the parents of the instance.
    FaceLight(const KnownLight& known, uint32_t instance, const InstanceRange& range);

    // A tile of the instance's shown side.
    struct Tile {
        uint32_t side = 0;  // of the tiles
        glm::dvec3 centroid{0.0};
        double area = 0;  // m^2
        FaceSample sample;
        // Mean square that no linear function shows, summed over RGB, (W/m^2)^2. Infinite if the
        // tiles around do not say, as beside a contact.
        float beyond = INFINITY;
        bool isDense = false;  // on a dense surface: `beyond` is what the corners of the face say
    };
    // Returns the index of the first tile of a face, and that of the first beyond the face.
    std::array<uint32_t, 2> tilesOf(int32_t face) const {
        return {firstOfFace[size_t(face)], firstOfFace[size_t(face) + 1]};
    }
    size_t tileCount() const { return tiles.size(); }
    size_t faceCount() const { return firstOfFace.size() - 1; }
    // Returns whether a tile shows light of both of its sides.
    bool isTranslucent(uint32_t tile) const {
        return !known.shown.isOwnAlone(known.tiles.firstSide(tiles[tile].side));
    }
    const Tile& tile(uint32_t index) const { return tiles[index]; }
    // Returns whether a face lies on a dense surface.
    bool isDense(int32_t face) const {
        const auto [begin, end] = tilesOf(face);
        return begin < end && tiles[begin].isDense;
    }
    // Returns the tile of a face that contains a point (m, relative to Patches::centre). Empty if
    // the face has none.
    std::optional<uint32_t> tileAt(int32_t face, const glm::dvec3& point) const;

    // Returns whether a point in the plane of a face is on it (m, relative to Patches::centre).
    bool isOn(int32_t face, const glm::dvec3& point) const;
    // Returns the normal of a face, a unit vector. Empty if the face has no tiles.
    std::optional<glm::dvec3> normal(int32_t face) const;

    // Returns the receiver of the sources' light at a point on a tile; empty if another surface
    // touches the tile there, or if the light of the tile has to do.
    std::optional<Receiver> receiver(uint32_t tile, const glm::dvec3& point, uint32_t seed) const;
    // Returns the light at a point of a tile, if the sources give it the light `ofSources`, W/m^2,
    // with the variance `variance` of the brightest channel. Without `ofSources`, all light is that
    // of the tile.
    FaceSample at(uint32_t tile, const glm::dvec3& point, const std::optional<glm::vec3>& ofSources,
                  float variance) const;

    // Return the exposed area, m^2, and the integral of the squared light over it, summed over RGB.
    double exposedArea() const { return area; }
    double signal() const { return squares; }

  private:
    void findSlopes(const InstanceRange& range);

    const KnownLight& known;
    const Instance& instance;
    std::vector<Tile> tiles;
    std::vector<uint32_t> firstOfFace;  // per face, and one more at the end
    std::vector<uint32_t> parentOf;     // per tile
    uint32_t firstTile = 0;             // over all parents
    // Per tile: the slope of the light that is not of the sources, per world axis, W/m^3.
    std::vector<glm::mat3> slopes;
    double area = 0, squares = 0;
};

}  // namespace raybundle
