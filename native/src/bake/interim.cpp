// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/interim.h"

#include <utility>

#include "job/error.h"
#include "reconstruction/interim_light.h"

namespace raybundle {

void Interim::offer(const std::function<std::vector<InstanceLight>()>& make) {
    if (!isWanted) return;
    std::vector<InstanceLight> next = make();
    if (converted) next = converted(std::move(next));
    const std::lock_guard lock(mutex);
    light = std::move(next);
    isWanted = false;
    ++made;
}

std::vector<glm::vec3> Interim::read(int32_t instance, rb_output output) {
    const std::lock_guard lock(mutex);
    if (made == 0) throw Error(RB_ERROR_INVALID_OPERATION, "the run has made no interim light yet");
    const InstanceLight& wanted = bakedInstance(light, instance);
    isWanted = true;
    return wanted.perCorner(output);
}

void offerDirect(const StageInput& in, const ShownLight& shown, std::vector<glm::vec3> direct) {
    if (!in.interim) return;
    in.interim->offer([&] {
        const Patches& patches = in.trace.patches;
        Irradiance light(patches.sideCount());
        light.direct = std::move(direct);
        const std::vector<float> exposed(patches.sideCount(), 1.0f);
        return interimLight(in.scene, {patches, exposed}, shown, shown.of(light, exposed));
    });
}

void offerFirstShots(const StageInput& in, const ShownLight& shown, SetLights& lights) {
    if (!in.interim) return;
    for (SetLight& light : lights) {
        light.irradiance.direct = light.irradiance.ofSources = light.shot.irradiance;
        if (!light.shot.indirect.empty()) light.irradiance.indirect = light.shot.indirect;
    }
    offerLight(in, shown, lights, std::vector<float>(in.trace.patches.sideCount(), 1.0f));
}

void offerLight(const StageInput& in, const ShownLight& shown, const SetLights& lights,
                const std::vector<float>& exposed) {
    if (!in.interim) return;
    in.interim->offer([&] {
        return interimLight(in.scene, {in.trace.patches, exposed}, shown,
                            shown.of(lights, exposed));
    });
}

}  // namespace raybundle
