// SPDX-License-Identifier: GPL-3.0-or-later
//
// Tiles: the patches as they were before some tiles were cut (refinement/refinement.h), and means
// over tiles of values of patches. A tile that is cut still meets as many lines as before. Its
// patches share them, so that each patch is noisier but the mean over the tile is not. Values that
// are interpolated between the corners of faces, none of which is smaller than a tile, have the
// noise of the tiles. Noise is therefore measured on tiles.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "patches/patches.h"
#include "patches/side.h"

namespace raybundle {

// The tiles of a set of patches.
class Tiles {
  public:
    // Keeps a reference to `cut`.
    explicit Tiles(const Patches& cut);
    Tiles(const Tiles&) = delete;

    // Returns patches of which each is a whole tile. If any tile is cut, they have no materials and
    // sheets.
    const Patches& patches() const { return uncut ? *uncut : original; }
    size_t sideCount() const { return patches().sideCount(); }
    // Returns how many times the edges of a tile are halved.
    int level(uint32_t tile) const { return uncut ? levels[tile] : 0; }
    // Returns the number of patches of a tile.
    uint32_t patchCount(uint32_t tile) const { return uncut ? first[tile + 1] - first[tile] : 1; }
    // Returns the side of the first patch of a tile that corresponds to a side of the tile.
    uint32_t firstSide(uint32_t side) const {
        return uncut ? sideOf(first[patchOf(side)], isBack(side)) : side;
    }

    // Return, per side of the tiles, the sum or the weighted mean of values per side of the
    // patches. `weight` is per side of the patches; if it is 0 on a whole tile, values are weighted
    // by area.
    std::vector<float> sum(const std::vector<float>& weight) const;
    std::vector<float> mean(const std::vector<float>& values,
                            const std::vector<float>& weight) const;
    std::vector<glm::vec3> mean(const std::vector<glm::vec3>& values,
                                const std::vector<float>& weight) const;
    // Returns, per side of the tiles, the standard error of the mean by area of values whose
    // standard errors are `errors` (per side of the patches). The errors of the patches are
    // independent.
    std::vector<float> errorOfMean(const std::vector<float>& errors) const;

  private:
    template <class Value>
    std::vector<Value> meanOf(const std::vector<Value>& values,
                              const std::vector<float>& weight) const;

    const Patches& original;
    std::optional<Patches> uncut;  // empty if no tile is cut
    std::vector<uint8_t> levels;   // per tile, see level()
    std::vector<uint32_t> first;   // per tile: its first patch; one more entry at the end
};

}  // namespace raybundle
