// SPDX-License-Identifier: GPL-3.0-or-later
#include "stated_error/energy_balance.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "patches/side.h"
#include "scene/channels.h"
#include "surfaces/translucence.h"

namespace raybundle {
namespace {

glm::dvec3 power(const Patches& patches, size_t side, const glm::vec3& perArea) {
    return double(patches.area[patchOf(side)]) * glm::dvec3(perArea);
}

// Sums of what lines bring to the sides of one object that they met, to estimate the mean.
struct BroughtByLines {
    double area = 0;        // exposed area, m^2
    glm::dvec3 power{0.0};  // W
    double open = 0;        // area times the share of lines that leave the scene, m^2
};

// Returns the irradiance that lines bring to a side: all but the light of the sources, W/m^2.
glm::vec3 byLines(const Irradiance& irradiance, size_t side) {
    return irradiance.all(side) - irradiance.ofSources[side];
}

// Returns the index of a side's object and orientation: 2 * instance, + 1 for backs.
size_t objectSide(const Patches& patches, size_t side) {
    return 2 * patches.parentAt(uint32_t(side)).instance + isBack(side);
}

// Returns the sums per objectSide().
std::vector<BroughtByLines> broughtByLines(const LitSurfaces& surfaces,
                                           const Irradiance& irradiance,
                                           const std::vector<float>& openShare) {
    std::vector<BroughtByLines> brought;  // as many as instances up to the last one with patches
    for (size_t side = 0; side < surfaces.exposed.size(); ++side) {
        const size_t of = objectSide(surfaces.patches, side);
        brought.resize(std::max(brought.size(), of + 1));
        if (openShare[side] < 0) continue;
        const double area = surfaces.exposedArea(side);
        brought[of].area += area;
        brought[of].power += area * glm::dvec3(byLines(irradiance, side));
        brought[of].open += area * double(openShare[side]);
    }
    return brought;
}

}  // namespace

void balanceEnergy(const LitSurfaces& surfaces, const SetLight& light,
                   const std::vector<float>& openShare, Report::Energy& energy) {
    const Patches& patches = surfaces.patches;
    const FirstShot& shot = light.shot;
    const Irradiance& irradiance = light.irradiance;
    const glm::vec3 worldExitance = glm::pi<float>() * light.worldRadiance;
    const std::vector<BroughtByLines> brought = broughtByLines(surfaces, irradiance, openShare);
    // The power that the insides of lamps emit is absorbed there.
    glm::dvec3 emitted = shot.emitted + light.direct.unseenPower();
    glm::dvec3 absorbed = light.direct.unseenPower(), escaped = shot.escaped;
    for (size_t side = 0; side < patches.sideCount(); ++side) {
        const double exposed = double(surfaces.exposed[side]);
        if (!patches.parentAt(uint32_t(side)).exchanges) {
            absorbed += exposed * power(patches, side, irradiance.ofSources[side]);
            continue;
        }
        const BroughtByLines& others = brought[objectSide(patches, side)];
        float open = openShare[side];
        glm::vec3 ofLines = byLines(irradiance, side);
        if (open < 0 && others.area > 0) {
            open = float(others.open / others.area);
            // Lines brought nothing to this side, but local rays may have. Otherwise take the
            // object's mean.
            if (ofLines == glm::vec3(0.0f)) ofLines = glm::vec3(others.power / others.area);
        }
        open = std::max(0.0f, open);
        glm::vec3 reflected = patches.reflectance[side] * ofLines +
                              shotReflectance(patches, shot, side) * irradiance.ofSources[side] +
                              passedOn(surfaces, side, irradiance.all(opposite(side)));
        if (!irradiance.byAngle.empty()) reflected += irradiance.byAngle[side];
        emitted += exposed * power(patches, side, shot.emission[side] + open * worldExitance);
        absorbed +=
            exposed * power(patches, side, irradiance.ofSources[side] + ofLines - reflected);
        escaped += exposed * power(patches, side, open * (shot.emission[side] + reflected));
    }
    // In a closed scene the redirected power is noise and stays in the balance.
    if (sumOfChannels(escaped) > sumOfChannels(shot.escaped)) escaped -= irradiance.redirected;
    energy.emitted += emitted;
    energy.absorbed += absorbed;
    energy.escaped += escaped;
}

double leakedShare(const Scene& scene, const Patches& patches, const std::vector<float>& weight,
                   const std::vector<float>& exactOpen, const std::vector<float>& open) {
    std::vector<double> difference(2 * scene.instances.size(), 0);
    double total = 0;
    for (size_t side = 0; side < weight.size(); ++side) {
        if (open[side] < 0) continue;
        difference[objectSide(patches, side)] +=
            double(weight[side] * (open[side] - exactOpen[side]));
        total += double(weight[side]);
    }
    double sum = 0;
    for (double d : difference) sum += std::abs(d);
    return total > 0 ? sum / total : 0;
}

double errorByWrongExchanges(const Patches& patches, double share) {
    double reflectance = 0, area = 0;
    for (size_t side = 0; side < patches.sideCount(); ++side) {
        const glm::vec3 rho = patches.reflectance[side] + patches.translucenceOf(side);
        reflectance += double(patches.area[patchOf(side)] * brightest(rho));
        area += double(patches.area[patchOf(side)]);
    }
    return area > 0 ? share / (1 - reflectance / area * (1 - share)) : 0;
}

}  // namespace raybundle
