// SPDX-License-Identifier: GPL-3.0-or-later
//
// What a bake shows while it runs: interim light and the noise so far.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include "bake/trace.h"
#include "reconstruction/instance_light.h"
#include "reconstruction/shown_light.h"
#include "transport/set_light.h"

namespace raybundle {

// Passes interim light from the thread that bakes to the thread that shows it. Light is only made
// when the last one has been read, so that an unread one costs no time.
class Interim {
  public:
    // Called by the bake. offer() calls `make` and keeps its result, per instance of the scene, if
    // light is wanted.
    bool wantsLight() const { return isWanted; }
    void offer(const std::function<std::vector<InstanceLight>()>& make);
    void setNoise(double relative) { lastNoise = relative; }
    // From now on, what offer() gets is passed through `convert` before it is kept.
    void convertBy(std::function<std::vector<InstanceLight>(std::vector<InstanceLight>)> convert) {
        converted = std::move(convert);
    }

    // Called by the reader. read() returns the radiance of an output at the corners of an instance,
    // W/(m^2 sr). Throws Error(INVALID_OPERATION) if there is no light yet, and
    // Error(INVALID_ARGUMENT) if the instance is not baked.
    std::vector<glm::vec3> read(int32_t instance, rb_output output);
    int32_t count() const { return made; }
    // Returns the noise at the last look, relative to the light; -1 before the first look.
    double noise() const { return lastNoise; }

  private:
    std::function<std::vector<InstanceLight>(std::vector<InstanceLight>)> converted;
    std::mutex mutex;
    std::vector<InstanceLight> light;
    std::atomic<bool> isWanted{true};
    std::atomic<int32_t> made{0};
    std::atomic<double> lastNoise{-1};
};

// These functions offer the light so far to the bake's Interim, and do nothing if there is none:
// direct irradiance per side, W/m^2; the light of first shots, which becomes the irradiance of
// `lights`; and the irradiance that `lights` have. `exposed` is per side, the share that no other
// surface covers, 0 to 1.
void offerDirect(const StageInput& in, const ShownLight& shown, std::vector<glm::vec3> direct);
void offerFirstShots(const StageInput& in, const ShownLight& shown, SetLights& lights);
void offerLight(const StageInput& in, const ShownLight& shown, const SetLights& lights,
                const std::vector<float>& exposed);

}  // namespace raybundle
