// SPDX-License-Identifier: GPL-3.0-or-later
//
// The nodes of dense surfaces (Patches::isDense), and the receivers that gather light for them.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "lights/receiver.h"
#include "reconstruction/corner_receivers.h"
#include "reconstruction/reconstruction_input.h"
#include "reconstruction/smooth_regions.h"

namespace raybundle {

// Returns per instance whether any of its shown light is gathered at nodes.
std::vector<bool> denseInstances(const Scene& scene, const Patches& patches,
                                 const ShownLight& shown);

// The receivers of all dense nodes. A node gathers if all of its faces are dense and no other
// surface touches it.
class DenseNodes {
  public:
    static constexpr uint32_t kNone = UINT32_MAX;

    // Finds the nodes of the instances for which `isDense` is true. `ranges` and `regions` are per
    // instance; only the regions of dense instances are used. References must outlive the object.
    DenseNodes(const ReconstructionInput& input, const std::vector<InstanceRange>& ranges,
               const std::vector<bool>& isDense, const std::vector<SmoothRegions>& regions);

    // The nodes of an instance.
    struct OfInstance {
        uint32_t first = 0, last = 0;      // its receivers are first to last - 1
        std::vector<uint32_t> receiverOf;  // per node; kNone if the node gathers nothing
        bool isAllDense = false;           // whether all of its faces are dense

        bool isEmpty() const { return first == last; }
    };
    const OfInstance& operator[](size_t instance) const { return ofInstances[instance]; }
    size_t instanceCount() const { return ofInstances.size(); }

    // Per receiver. Faces that share no node with others, as flat shading has them, have one
    // receiver in their middle, and isWholeFace() is true.
    const std::vector<Receiver>& receivers() const { return all; }
    bool isWholeFace(uint32_t receiver) const { return wholeFaces[receiver]; }
    // Returns the position that the receiver stands for, m, relative to Patches::centre.
    const glm::vec3& position(uint32_t receiver) const { return positions[receiver]; }

    // Calls visit(side, receiver) for each dense side of an instance and each corner of it that has
    // a receiver.
    template <class Visit>
    void forEachCorner(size_t instance, const Visit& visit) const {
        for (uint32_t p = ranges[instance].firstParent; p < ranges[instance].lastParent; ++p) {
            const uint32_t side = sideOfParent(instance, p);
            if (!input.shown.isGatheredAtNodes(side)) continue;
            for (const int32_t corner : input.patches.cells[input.patches.parents[p].cell].corner)
                if (corner >= 0)
                    if (const uint32_t r = receiverAt(instance, corner); r != kNone) visit(side, r);
        }
    }

    // Returns the pairs of receivers at the ends of edges, and of receivers at the same vertex that
    // face alike. Receivers are counted from the first one of the instance.
    std::vector<ReceiverPair> neighbours(size_t instance) const;

  private:
    // What the parents of an instance tell about its nodes and cells.
    struct Faces;
    Faces facesOf(size_t instance) const;
    std::vector<std::optional<CornerReceiver>> chooseCorners(size_t instance,
                                                             const Faces& faces) const;
    void addReceivers(size_t instance);
    std::optional<uint32_t> addWholeFace(size_t instance, const Faces& faces,
                                         const std::vector<std::optional<CornerReceiver>>& chosen,
                                         uint32_t first, uint32_t end);
    uint32_t add(const Receiver& receiver, const glm::vec3& position, bool isWholeFace);
    uint32_t sideOfParent(size_t instance, uint32_t parent) const;
    uint32_t receiverAt(size_t instance, int32_t corner) const {
        return ofInstances[instance].receiverOf[regions[instance].nodeOf[size_t(corner)]];
    }

    const ReconstructionInput& input;
    const std::vector<InstanceRange>& ranges;
    const std::vector<SmoothRegions>& regions;
    std::vector<OfInstance> ofInstances;
    std::vector<Receiver> all;
    std::vector<glm::vec3> positions;
    std::vector<bool> wholeFaces;
};

}  // namespace raybundle
