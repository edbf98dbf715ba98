// SPDX-License-Identifier: GPL-3.0-or-later
//
// What surfaces that are not Lambert's send towards a direction more, or less, than in the mean
// over all of them, by cells of directions: of the light that other surfaces sent them, and roughly
// of that of the sources, for which transport/directed_light.h is sharper.
//
// Source: Immel, Cohen and Greenberg, "A Radiosity Method for Non-Diffuse Environments" (1986):
// exitance by cells of directions.
// Differs:
// - Light between patches is solved for as if they were Lambert's, and what they send beyond that is
//   brought along the same lines, turn by turn.
// - Few and wide cells, of the hemisphere over the side alone, and a byte a channel: what they hold
//   changes slowly with the direction and is little of the light.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "patches/patches.h"
#include "transport/first_shot.h"

namespace raybundle {

class ScatteredLight {
  public:
    static constexpr uint32_t kEdge = 6, kCells = kEdge * kEdge;
    // By channel and by where light comes from or goes to: cells of the same share of Lambert's
    // cosine, squares of the square that is mapped to the disk below the hemisphere.
    using Cells = std::array<std::array<float, kCells>, 3>;

    // Of the light of a first shot, as if it came in from the directions that it knows; nothing, if
    // it knows none. patches must outlive the object.
    ScatteredLight(const Patches& patches, const FirstShot& shot);

    // No side sends anything by direction, ever.
    bool isNone() const { return indices.empty(); }
    bool isNone(uint32_t side) const { return isNone() || indices[side] == kNone; }

    // Adds light that comes to a side from a unit vector.
    void add(uint32_t side, const glm::vec3& direction, const glm::vec3& light, Cells& cells) const;
    // Of a side that is not isNone, from here on: irradiance, W/m^2. Several sides may be set at
    // once.
    void set(uint32_t side, const Cells& arriving);

    // Exitance of a side towards a direction (unit) away from it, less the mean over all
    // directions, W/m^2: positive or negative.
    glm::vec3 towards(uint32_t side, const glm::vec3& direction) const;
    // RMS of that over all directions, of the brightest channel.
    float contrast(uint32_t side) const;

  private:
    static constexpr uint32_t kNone = UINT32_MAX;
    struct Transfer;
    struct Sent {
        glm::vec3 x, y;  // unit vectors in the side
        float unit = 0;  // W/m^2
        std::array<std::array<int8_t, 3>, kCells> cells{};
    };
    void findTransfers();

    const Patches& patches;
    std::vector<uint32_t> indices;  // per side, into sent
    std::vector<Sent> sent;
    std::vector<std::shared_ptr<const Transfer>> transfers;  // per entry of patches.scattering
};

}  // namespace raybundle
