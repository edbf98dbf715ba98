// SPDX-License-Identifier: GPL-3.0-or-later
//
// What surfaces that are not Lambert's send towards a direction more, or less, than in the mean
// over all of them, by cells of directions: of the light that other surfaces and an even sky sent
// them, and roughly of that of the sources, for which first_shot/directed_light.h is sharper.
//
// Source: Immel, Cohen and Greenberg, "A Radiosity Method for Non-Diffuse Environments" (1986):
// exitance by cells of directions.
// Differs:
// - Light between patches is solved for as if they were Lambert's, and what they send beyond that
//   is brought along the same lines, turn by turn.
// - Which cells are open to an even sky follows from what lines to other patches leave of them.
// - Few and wide cells, of the hemisphere over the side alone, and a byte a channel: what they hold
//   changes slowly with the direction and is little of the light.
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

class ScatteredLight {
  public:
    static constexpr uint32_t kEdge = 6, kCells = kEdge * kEdge;
    // By where light comes from or goes to: cells of the same share of Lambert's cosine, squares of
    // the square that is mapped to the disk below the hemisphere.
    using Hemisphere = std::array<float, kCells>;
    using Cells = std::array<Hemisphere, 3>;  // by channel

    // Of the light of a first shot, as if it came in from the directions that it knows; nothing, if
    // it knows none. seesSky: whether there is an even one. patches must outlive the object.
    ScatteredLight(const Patches& patches, const FirstShot& shot, bool seesSky);

    // The same with other numbers of the sides: per side, the one that it has here. Nothing more is
    // to be set in it.
    ScatteredLight renumbered(const std::vector<uint32_t>& sides) const;

    // No side sends anything by direction, ever.
    bool isNone() const { return indices.empty(); }
    bool isNone(uint32_t side) const { return isNone() || indices[side] == kNone; }

    // Of a side that is not isNone, from here on; several sides may be looked at, or set, at once.
    // Adds light that comes from a unit vector.
    void add(uint32_t side, const glm::vec3& direction, const glm::vec3& light, Cells& cells) const;
    // Likewise a share of all lines.
    void add(uint32_t side, const glm::vec3& direction, float share, Hemisphere& shares) const;
    // What is open to the sky: `sky` of all lines, where those that meet surfaces (shares of all)
    // leave room for it. For a scene that sees one; so is what follows.
    void setOpen(uint32_t side, const Hemisphere& met, float sky);
    // Adds an even sky's light, of so much exitance, W/m^2. Returns the mean terms of the angles
    // (scene/angles.h) at which it arrives times its share of all lines, and that share.
    std::pair<glm::vec4, float> addSky(uint32_t side, const glm::vec3& exitance,
                                       Cells& cells) const;
    // What arrives, W/m^2.
    void set(uint32_t side, const Cells& arriving);

    // Exitance of a side towards a direction (unit) away from it, less the mean over all
    // directions, W/m^2: positive or negative.
    glm::vec3 towards(uint32_t side, const glm::vec3& direction) const;
    // RMS of that over all directions, of the brightest channel.
    float contrast(uint32_t side) const;

  private:
    static constexpr uint32_t kNone = UINT32_MAX;
    struct Transfer;
    using Open = std::array<int8_t, kCells>;  // shares of the light of an even sky
    struct Sent {
        glm::vec3 x, y;  // unit vectors in the side
        float unit = 0;  // W/m^2
        std::array<std::array<int8_t, 3>, kCells> cells{};
    };
    void findTransfers();

    const Patches& patches;
    std::vector<uint32_t> indices;  // per side, into sent
    std::vector<Sent> sent;
    std::vector<Open> open;  // likewise; empty where there is no even sky
    std::vector<std::shared_ptr<const Transfer>> transfers;  // per entry of patches.scattering
};

}  // namespace raybundle
