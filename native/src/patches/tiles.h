// SPDX-License-Identifier: GPL-3.0-or-later
//
// Tiles: the patches as they were before some were cut (refinement/refinement.h), and the means
// over them of what cut patches have. A cut tile has the lines that it had: its patches share them,
// so that each has more noise and the mean over the tile no more. What is interpolated between the
// corners of faces, none smaller than a tile, has that of the tiles; so noise is measured on them.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

class Tiles {
  public:
    // Where nothing is cut, `cut` must outlive the object.
    explicit Tiles(const Patches& cut);
    Tiles(const Tiles&) = delete;

    // A patch a tile, without materials.
    const Patches& patches() const { return uncut ? *uncut : original; }
    size_t sideCount() const { return patches().sideCount(); }
    // How often the edges of a tile are halved.
    int level(uint32_t tile) const { return uncut ? levels[tile] : 0; }
    // The patches of a tile: their number, and of the first the side that a side of the tile has.
    uint32_t patchCount(uint32_t tile) const { return uncut ? first[tile + 1] - first[tile] : 1; }
    uint32_t firstSide(uint32_t side) const {
        return uncut ? 2 * first[side / 2] + side % 2 : side;
    }

    // From values per side of the patches to values per side of the tiles. weight: per side of the
    // patches; where a whole tile has none, the area counts.
    std::vector<float> sum(const std::vector<float>& weight) const;
    std::vector<float> mean(const std::vector<float>& values,
                            const std::vector<float>& weight) const;
    std::vector<glm::vec3> mean(const std::vector<glm::vec3>& values,
                                const std::vector<float>& weight) const;
    // Standard errors of the means by area of values with independent standard errors.
    std::vector<float> errorOfMean(const std::vector<float>& errors) const;

  private:
    template <class Value>
    std::vector<Value> meanOf(const std::vector<Value>& values,
                              const std::vector<float>& weight) const;

    const Patches& original;
    std::optional<Patches> uncut;
    std::vector<uint8_t> levels;
    std::vector<uint32_t> first;  // per tile: its first patch; one more at the end
};

}  // namespace raybundle
