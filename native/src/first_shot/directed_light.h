// SPDX-License-Identifier: GPL-3.0-or-later
//
// The part of the reflected light that depends on the direction, on surfaces that are not
// Lambert's: the difference of the exitance towards a direction from its mean over all directions.
// There are two such parts. Light of the sources is reflected according to the direction that it
// comes from: a glossy surface mirrors it, a rough surface sends some of it back. All reflected
// light that leaves from under a layer depends on the angle at which it leaves.
//
// Source: none; the thesis has Lambert's surfaces only. The lines between two patches are
// distributed as the light that one gets from the other by Lambert's law. The direction from one
// patch to another is that between their centres, or if they are near each other, the directions
// between points on both.
// Left out here: light that was reflected before, emission that bundles carry, and the constant
// part of the world (transport/scattered_light.h has all of these).
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "first_shot/first_shot.h"
#include "lights/directed_emission.h"
#include "patches/patches.h"
#include "surfaces/lobe.h"

namespace raybundle {

// Returns the share of the lines, 0 to 1, that suffices for the light that depends on the
// direction, because that light causes less noise along lines than all reflected light. `bent` is
// the light that is sent otherwise than by Lambert's law, RMS over the directions, and `reflected`
// is all reflected light, both in W.
double shareOfLines(double bent, double reflected);

// The exitance of surfaces that are not Lambert's, by direction.
class DirectedLight : public DirectedEmission {
  public:
    // Takes all light of a first shot, the light that the first shot has not distributed further
    // itself, or no light of it. The object is empty if the first shot has no directions of light,
    // or if all surfaces are Lambert's. `patches` must outlive the object.
    enum class Of { ALL, BEYOND_FIRST_SHOT, NOTHING };
    DirectedLight(const Patches& patches, const FirstShot& shot, Of of = Of::BEYOND_FIRST_SHOT);

    bool isNone() const { return all.empty(); }
    bool isNone(uint32_t side) const { return isNone() || first[side] == first[side + 1]; }

    // Returns the result of shareOfLines for this light.
    double neededLines() const { return lineShare; }

    // Returns the difference of the exitance of a side towards a direction (unit, away from the
    // side) from the mean over all directions, W/m^2 over the whole area of the patch. It may be
    // negative.
    glm::vec3 towards(uint32_t side, const glm::vec3& direction) const;
    // Returns the same difference towards the side of another patch, as the mean over the lines
    // between the two patches. `random` must differ from call to call.
    glm::vec3 between(uint32_t side, uint32_t other, uint32_t random) const;

    glm::vec3 beyondMean(uint32_t side, const glm::vec3& direction,
                         const glm::vec3& mean) const override;

    // Returns whether diffuse light of any surface leaves by angle, as from under a layer. Then all
    // reflected light depends on the direction.
    bool hasLayers() const { return !layers.empty(); }
    // Returns the share of all light reflected by a side that goes towards a direction in addition
    // to Lambert's law. It may be negative.
    glm::vec3 layer(uint32_t side, const glm::vec3& direction) const;
    // Returns whether the angle matters at which reflected light leaves or arrives.
    bool hasAngles() const { return !middles.empty(); }
    // Returns the unit vector from a side to the side of another patch: between their centres, or
    // if the patches are near each other, along one of the lines between them. `random` must differ
    // from call to call.
    glm::vec3 wayBetween(uint32_t side, uint32_t other, uint32_t random) const;

  private:
    struct Layer {
        glm::vec3 normal{0.0f};
        glm::vec3 diffuse{0.0f};  // diffuse share of what the side reflects
        uint32_t scattering = 0;  // index in Patches::scattering
    };
    struct Part {
        Lobe lobe;
        glm::vec3 exitance;  // W/m^2
    };
    void findMiddles();
    void findLayers();
    double enoughLines(const FirstShot& shot) const;
    void addParts(uint32_t side, const FirstShot& shot, std::vector<Part>& parts) const;
    bool areNear(uint32_t side, uint32_t other) const;
    glm::vec3 middleWay(uint32_t side, uint32_t other) const;
    template <class Add>
    void forNearWays(uint32_t side, uint32_t other, uint32_t random, const Add& add) const;

    const Patches& patches;
    std::vector<uint32_t> first;  // per side, index in `all`; one more at the end
    std::vector<Part> all;
    std::vector<glm::vec4> middles;  // per patch: centre, and width in w, m
    double lineShare = 0;
    std::vector<Layer> layers;  // per side; empty if there are none
};

}  // namespace raybundle
