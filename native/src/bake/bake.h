// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "bundles/line_counts.h"
#include "job/progress.h"
#include "job/report.h"
#include "job/settings.h"
#include "patches/tiles.h"
#include "reconstruction/instance_light.h"
#include "reconstruction/shown_light.h"
#include "scene/scene.h"
#include "stated_error/noise.h"
#include "transport/set_light.h"
#include "transport/transport.h"
#include "visibility/visibility.h"

namespace raybundle {

class Threads;
struct SolveInput;
struct Trace;

// One bake: settings in, light per corner and a report out. Keeps patches and traced lines for the
// next run on the same geometry.
class Bake {
  public:
    Bake();
    ~Bake();

    Settings settings;
    Progress progress;

    // The whole method, stage by stage.
    void run(const Scene& scene);

    bool hasRun() const { return ran; }
    const std::string& reportJson() const { return json; }

    // Patches of the last run and the light on them, for comparison of methods. Only after a run.
    const Patches& patches() const;
    const Irradiance& patchIrradiance() const { return irradiance; }
    // Per side: the share of it that nothing covers.
    const std::vector<float>& exposedShare() const { return exposed; }

    // The result of an instance with role BAKE; throws Error if there is none.
    const InstanceLight& instanceLight(int32_t instance) const;
    // The same by the light of one light set.
    const CornerLight& setLight(int32_t set, int32_t instance) const;

  private:
    struct Exchanged;

    void runStages(const Scene& scene, const Threads& threads);
    void noteWhatIsGiven(const Scene& scene, const Threads& threads, Report& report) const;
    void makePatches(const Scene& scene, Report& report);
    std::vector<CoarseShot> startLines(const Scene& scene, Report& report);
    std::vector<CoarseShot> cutPatches(const Scene& scene, Report& report);
    Exchanged exchange(const SolveInput& in, SetLights& lights, Report& report);
    Transports transportsOf(const SetLights& lights, const ShownLight& shown) const;
    std::vector<InstanceLight> show(const SolveInput& in, const SetLights& lights,
                                    const Exchanged& exchanged, Report& report);
    void noteWhatWasTraced(Report& report) const;

    std::unique_ptr<Trace> trace;  // of the last run's geometry
    // Of the last run, per side: see patchIrradiance and exposedShare.
    Irradiance irradiance;
    std::vector<float> exposed;
    std::vector<InstanceLight> light;
    std::string json;
    bool ran = false;
};

}  // namespace raybundle
