// SPDX-License-Identifier: GPL-3.0-or-later
//
// How the exitance of surfaces that are not Lambert's deviates, by cells of directions, from its
// mean over all directions. The light may come from other surfaces, from an even sky, and from the
// sources. For light of the sources this is a rough form; first_shot/directed_light.h is sharper.
//
// Source: Immel, Cohen and Greenberg, "A Radiosity Method for Non-Diffuse Environments" (1986):
// exitance by cells of directions.
// Differs:
// - Light between patches is solved for as if all surfaces were Lambert's. The deviation from
//   Lambert's law is brought along the same lines, turn by turn.
// - Which cells are open to an even sky follows from the lines that meet other patches: the sky
//   fills the rest of each cell.
// - Cells are few and wide, cover only the hemisphere over the side, and take one byte per channel.
//   Their values change slowly with the direction and are a small part of the light.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "first_shot/first_shot.h"
#include "patches/patches.h"

namespace raybundle {

// Deviation of the exitance from its mean, per side and cell of directions.
class ScatteredLight {
  public:
    static constexpr uint32_t kEdge = 6, kCells = kEdge * kEdge;
    // Values by the direction that light comes from or goes to. All cells have equal integrals of
    // the cosine. They are squares of a kEdge by kEdge grid on the unit square, which onDisk() maps
    // to the disk below the hemisphere.
    using Hemisphere = std::array<float, kCells>;
    using Cells = std::array<Hemisphere, 3>;  // by channel

    // The four cells around a direction, and where the direction lies in the square between their
    // centres.
    struct Place {
        static constexpr int kWhole = 255;
        // `first` is the index of the first cell. `s` and `t` are 0 to kWhole across the square.
        uint8_t first = 0, s = 0, t = 0;
    };
    // Returns the place of a direction in the cells of a side. `normal` is the normal of the side,
    // `direction` a unit vector that points away from the side.
    static Place placeOf(const glm::vec3& normal, const glm::vec3& direction);

    // Takes the light of a first shot, as if it came from the directions in shot.incoming. If there
    // are no such directions, no side sends anything yet. `seesSky` states whether there is an even
    // sky. `patches` must outlive the object.
    ScatteredLight(const Patches& patches, const FirstShot& shot, bool seesSky);

    // Returns a copy with other indices of sides: side k of the copy is side sides[k] of this
    // object. The copy must not be changed by setOpen() or set().
    ScatteredLight renumbered(const std::vector<uint32_t>& sides) const;

    // Returns whether no side, or not this side, can send light by direction.
    bool isNone() const { return indices.empty(); }
    bool isNone(uint32_t side) const { return isNone() || indices[side] == kNone; }

    // Returns whether this side sends light by direction.
    bool isDark(uint32_t side) const { return isNone(side) || !(sent[indices[side]].unit > 0); }

    // The functions below require a side that is not isNone(). They may be called for several sides
    // at once.
    //
    // Adds light that comes from a direction to the cells. `direction` is a unit vector towards the
    // origin of the light; `light` is irradiance, W/m^2.
    void add(uint32_t side, const glm::vec3& direction, const glm::vec3& light, Cells& cells) const;
    // Adds a share of all lines of the side that come from a direction to the cells.
    void add(uint32_t side, const glm::vec3& direction, float share, Hemisphere& shares) const;
    // Computes which directions are open to the sky. `sky` is the share of the side's lines that
    // end in the sky. `met` holds, by cell, the shares of its lines that meet surfaces; the sky
    // fills the room that they leave. Requires `seesSky`.
    void setOpen(uint32_t side, const Hemisphere& met, float sky);
    // Adds the light of an even sky to the cells. `exitance` is that of the sky, W/m^2. Returns the
    // share of all lines that end in the sky as second value, and as first value the mean angle
    // terms (scene/angles.h) of this light times this share. Only after setOpen().
    std::pair<glm::vec4, float> addSky(uint32_t side, const glm::vec3& exitance,
                                       Cells& cells) const;
    // Sets the light that a side sends by direction, from the irradiance that arrives by cell,
    // W/m^2.
    void set(uint32_t side, const Cells& arriving);

    // Returns the exitance of a side towards a direction minus its mean over all directions, W/m^2.
    // It may be negative. `direction` is a unit vector that points away from the side. The exitance
    // is relative to the same area as the irradiance in set().
    glm::vec3 towards(uint32_t side, const glm::vec3& direction) const;
    // Returns the same for the place of the direction.
    glm::vec3 towards(uint32_t side, const Place& place) const;
    // Returns the RMS of towards() over all directions, by the channel with the largest magnitude,
    // W/m^2.
    float contrast(uint32_t side) const;

  private:
    static constexpr uint32_t kNone = UINT32_MAX;
    struct Transfer;
    // Per cell: share that is open to an even sky, in steps of 1 / kOpenSteps.
    using Open = std::array<int8_t, kCells>;
    // The light that a side sends by direction. The value of a cell is `unit` times its number of
    // steps.
    struct Sent {
        glm::vec3 x, y;  // unit vectors in the plane of the side
        float unit = 0;  // W/m^2
        std::array<std::array<int8_t, 3>, kCells> cells{};
    };
    void findTransfers();

    const Patches& patches;
    std::vector<uint32_t> indices;  // per side: index in `sent` and `open`
    std::vector<Sent> sent;
    std::vector<Open> open;                                  // empty if there is no even sky
    std::vector<std::shared_ptr<const Transfer>> transfers;  // per entry of patches.scattering
};

}  // namespace raybundle
