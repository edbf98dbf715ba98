// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/energy_balance.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "scene/channels.h"
#include "transport/translucence.h"

namespace raybundle {
namespace {

double sum(const glm::dvec3& v) { return v.x + v.y + v.z; }

glm::dvec3 power(const Patches& patches, size_t side, const glm::vec3& perArea) {
    return double(patches.area[side / 2]) * glm::dvec3(perArea);
}

}  // namespace

void balanceEnergy(const Patches& patches, const SetLight& light,
                   const std::vector<float>& exposedShare, const std::vector<float>& openShare,
                   Report& report) {
    const FirstShot& shot = light.shot;
    const Irradiance& irradiance = light.irradiance;
    const glm::vec3 worldExitance = glm::pi<float>() * light.worldRadiance;
    // What the insides of lamps emit they absorb.
    glm::dvec3 emitted = shot.emitted + light.direct.unseenPower();
    glm::dvec3 absorbed = light.direct.unseenPower(), escaped = shot.escaped;
    for (size_t side = 0; side < patches.sideCount(); ++side) {
        const double exposed = double(exposedShare[side]);
        const float open = openShare[side];
        if (!patches.parentAt(uint32_t(side)).exchanges) {
            absorbed += exposed * power(patches, side, irradiance.gathered[side]);
            continue;
        }
        const glm::vec3 total = irradiance.all(side);
        glm::vec3 reflected = patches.reflectance[side] * (total - irradiance.gathered[side]) +
                              shotReflectance(patches, shot, side) * irradiance.gathered[side] +
                              passedOn(patches, exposedShare, side, irradiance.all(side ^ 1));
        if (!irradiance.byAngle.empty()) reflected += irradiance.byAngle[side];
        emitted += exposed * power(patches, side, shot.emission[side] + open * worldExitance);
        absorbed += exposed * power(patches, side, total - reflected);
        escaped += exposed * power(patches, side, open * (shot.emission[side] + reflected));
    }
    // In a closed scene that is noise, and stays in the balance.
    if (sum(escaped) > sum(shot.escaped)) escaped -= irradiance.redirected;
    report.emitted += sum(emitted);
    report.absorbed += sum(absorbed);
    report.escaped += sum(escaped);
}

double leakedShare(const Scene& scene, const Patches& patches, const std::vector<float>& weight,
                   const std::vector<float>& exactOpen, const std::vector<float>& open) {
    std::vector<double> difference(2 * scene.instances.size(), 0);
    double total = 0;
    for (size_t side = 0; side < weight.size(); ++side) {
        const uint32_t instance = patches.parents[patches.parentOf[side / 2]].instance;
        difference[2 * instance + side % 2] +=
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
        reflectance += double(patches.area[side / 2] * brightest(rho));
        area += double(patches.area[side / 2]);
    }
    return area > 0 ? share / (1 - reflectance / area * (1 - share)) : 0;
}

}  // namespace raybundle
