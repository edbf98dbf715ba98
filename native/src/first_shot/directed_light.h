// SPDX-License-Identifier: GPL-3.0-or-later
//
// What surfaces that are not Lambert's send towards a direction more, or less, than in the mean
// over all of them. Light of the sources by the direction it comes from: a glossy surface mirrors
// it, a rough one sends some of it back. And of all light, what leaves from under a layer by the
// angle at which it leaves.
//
// Source: none; the thesis has Lambert's surfaces only. Lines join two patches in proportion to
// what one gets of the other's light by Lambert's law; where their middles lie tells the direction,
// and where they are near, points on both.
// What is left out: light that was reflected before, that bundles bring of emission, and the
// constant part of the world (transport/scattered_light.h has all that).
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "first_shot/first_shot.h"
#include "lights/directed_emission.h"
#include "patches/patches.h"
#include "surfaces/lobe.h"

namespace raybundle {

// How much less noise light by direction makes along lines than all reflected light: a share of the
// lines that is enough for it, 0 to 1. bent: what is sent to where Lambert's law would not, RMS
// over the directions; reflected: all; W.
double shareOfLines(double bent, double reflected);

class DirectedLight : public DirectedEmission {
  public:
    // Of the light of a first shot, or of what it has not sent on itself; none, if that knows no
    // directions or all surfaces are Lambert's. patches must outlive the object.
    enum class Of { ALL, BEYOND_FIRST_SHOT };
    DirectedLight(const Patches& patches, const FirstShot& shot, Of of = Of::BEYOND_FIRST_SHOT);

    bool isNone() const { return all.empty(); }
    bool isNone(uint32_t side) const { return isNone() || first[side] == first[side + 1]; }

    // See shareOfLines.
    double neededLines() const { return lineShare; }

    // Exitance of a side towards a direction (unit) away from it, less the mean over all
    // directions, W/m^2 over its whole area: positive or negative.
    glm::vec3 towards(uint32_t side, const glm::vec3& direction) const;
    // Towards the side of another patch, the mean over the lines between the two; random: differs
    // from call to call.
    glm::vec3 between(uint32_t side, uint32_t other, uint32_t random) const;

    glm::vec3 beyondMean(uint32_t side, const glm::vec3& direction,
                         const glm::vec3& mean) const override;

    // Whether diffuse light leaves by angle anywhere: of that all light has directions.
    bool hasLayers() const { return !layers.empty(); }
    // Of what a side reflects in all, the share that goes towards a direction more than by
    // Lambert's law, or less.
    glm::vec3 layer(uint32_t side, const glm::vec3& direction) const;
    // Whether it matters at which angle light that was reflected leaves or arrives.
    bool hasAngles() const { return !middles.empty(); }
    // The way from a side to another patch's, unit: between their middles, or where they are near
    // the way of one of the lines between the two. random: differs from call to call.
    glm::vec3 wayBetween(uint32_t side, uint32_t other, uint32_t random) const;

  private:
    struct Layer {
        glm::vec3 normal{0.0f};
        glm::vec3 diffuse{0.0f};  // share of what the side reflects
        uint32_t scattering = 0;  // in that of the patches
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
    std::vector<uint32_t> first;  // per side, into all; one more at the end
    std::vector<Part> all;
    std::vector<glm::vec4> middles;  // per patch, and its width, metres
    double lineShare = 0;
    std::vector<Layer> layers;  // per side; empty where there are none
};

}  // namespace raybundle
