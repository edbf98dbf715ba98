// SPDX-License-Identifier: GPL-3.0-or-later
#include "stated_error/dense_surplus.h"

#include <algorithm>
#include <cmath>

#include "job/cancellation.h"
#include "patches/neighbours.h"

namespace raybundle {
namespace {

constexpr float kOfRamp = 1.0f / 12;
// The square of a triangle's height relative to the distance to the middle of the triangle beside
// it, if both have equal sides. For squares it is 1.
constexpr float kTriangleHeight = 2.25f;

// The change of light on faces, as their corners have gathered it.
class FaceGradients {
  public:
    FaceGradients(const Patches& patches, const InstanceLight& light)
        : patches(patches), light(light) {}

    // Returns how the light would change from the middle of a parent to that of another if it
    // changed as between the corners of the former, W/m^2. Both planes are unfolded into one.
    glm::vec3 changeTowards(const Parent& from, const Parent& to) const {
        const glm::vec3 apart = middle(to) - middle(from);
        const glm::vec3 flat = apart - glm::dot(apart, from.normal) * from.normal;
        if (!(glm::dot(flat, flat) > 0)) return glm::vec3(0.0f);
        const glm::vec3 along = flat * (glm::length(apart) / glm::length(flat));
        const Cell& cell = patches.cells[from.cell];
        // Affine coordinates of `along`.
        const glm::vec3 normal = glm::cross(cell.a, cell.b);
        const float scale = glm::dot(normal, normal);
        if (!(scale > 0)) return glm::vec3(0.0f);
        const float s = glm::dot(normal, glm::cross(along, cell.b)) / scale,
                    t = glm::dot(normal, glm::cross(cell.a, along)) / scale;
        auto at = [&](size_t k) {
            const size_t corner = size_t(cell.corner[k]);
            return light.direct[corner] + light.indirect[corner];
        };
        if (cell.isTriangle()) return s * (at(1) - at(0)) + t * (at(2) - at(0));
        return 0.5f * (s * (at(1) - at(0) + at(2) - at(3)) + t * (at(3) - at(0) + at(2) - at(1)));
    }

  private:
    static glm::vec3 middle(const Parent& parent) {
        return parent.position(parent.isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f));
    }

    const Patches& patches;
    const InstanceLight& light;
};

// How much more the light changes on a face than on those beside it.
class Step {
  public:
    // Adds a face beside it. `own` is the change of the light towards its middle, and `excess` the
    // difference between that and the change that the other face has over the same distance.
    void add(const glm::vec3& own, const glm::vec3& excess) {
        const float square = glm::dot(own, own);
        if (!(square > 0)) return;
        const float along = glm::dot(excess, own) / std::sqrt(square);
        weight += square;
        squares += square * along * std::abs(along);
    }
    // Returns the square of the change that is only on this face, (W/m^2)^2.
    float square() const { return weight > 0 ? std::max(0.0f, squares / weight) : 0.0f; }

  private:
    float weight = 0, squares = 0;
};

}  // namespace

std::vector<float> denseSurplus(const Patches& patches, uint32_t firstParent, uint32_t lastParent,
                                rb_side side, const std::vector<bool>& isGathered,
                                const InstanceLight& light) {
    if (firstParent >= lastParent) return {};
    const uint32_t first = patches.parents[firstParent].firstPatch;
    const Parent& last = patches.parents[lastParent - 1];
    std::vector<Step> steps(last.firstPatch + last.patchCount() - first);
    const FaceGradients gradients(patches, light);
    size_t looked = 0;
    for (const TilePair& pair : neighbouringTiles(patches, firstParent, lastParent)) {
        throwIfCancelledAt(looked++);
        if (!isGathered[2 * pair.first + size_t(side)] ||
            !isGathered[2 * pair.second + size_t(side)])
            continue;
        const Parent &a = patches.parentAt(2 * pair.first), &b = patches.parentAt(2 * pair.second);
        const glm::vec3 ofA = gradients.changeTowards(a, b), ofB = gradients.changeTowards(b, a);
        steps[pair.first - first].add(ofA, ofA + ofB);
        steps[pair.second - first].add(ofB, ofA + ofB);
    }
    std::vector<float> result(steps.size());
    for (uint32_t k = 0; k < steps.size(); ++k)
        result[k] = kOfRamp * steps[k].square() *
                    (patches.parentAt(2 * (first + k)).isTriangle ? kTriangleHeight : 1.0f);
    return result;
}

}  // namespace raybundle
