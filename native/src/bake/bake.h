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
#include "job/memory.h"
#include "job/progress.h"
#include "job/report.h"
#include "job/settings.h"
#include "patches/finer_mesh.h"
#include "patches/tiles.h"
#include "reconstruction/instance_light.h"
#include "reconstruction/shown_light.h"
#include "scene/scene.h"
#include "stated_error/noise.h"
#include "transport/set_light.h"
#include "transport/transport.h"
#include "visibility/visibility.h"

namespace raybundle {

class DraftLight;
class Interim;
class SourceStrengths;
class Threads;
class WorldSource;
struct SolveInput;
struct Trace;

// A bake: takes settings, and computes the light at the corners of the scene's meshes and a report.
// Keeps the patches and the traced lines, which the next run uses if its geometry is equal.
class Bake {
  public:
    Bake();
    ~Bake();

    Settings settings;
    Progress progress;
    // Receives light and noise while the bake runs. Null: nobody looks. Must outlive the run.
    Interim* interim = nullptr;

    // Runs all stages of the bake. The results of the previous run remain if the run fails. Throws
    // Error(INVALID_ARGUMENT) if the settings or the scene cannot be baked, Error(CANCELLED) if the
    // caller cancels through `progress`, Error(OUT_OF_MEMORY) if the bake reaches its memory
    // limit, and std::bad_alloc if memory runs out.
    void run(const Scene& scene);

    bool hasRun() const { return ran; }
    const std::string& reportJson() const { return json; }

    // Return the patches of the last run and the irradiance per patch side, W/m^2. They serve to
    // compare methods. Call them only after a run.
    const Patches& patches() const;
    const Irradiance& patchIrradiance() const { return irradiance; }
    // Returns per side the share of its area that no other surface covers, 0 to 1.
    const std::vector<float>& exposedShare() const { return exposed; }

    // Returns the result of an instance with role BAKE. Throws Error(INVALID_OPERATION) before the
    // first run, and Error(INVALID_ARGUMENT) if there is no such instance or it has another role.
    const InstanceLight& instanceLight(int32_t instance) const;
    // Returns the result of an instance by the light of one light set. Throws as instanceLight()
    // does, and Error(INVALID_ARGUMENT) if the last run had no such light set.
    const CornerLight& setLight(int32_t set, int32_t instance) const;
    // Returns the mesh of an instance at whose corners the result is, if the last run has adapted
    // the meshes (Settings::adaptMeshes). Throws as instanceLight() does, and
    // Error(INVALID_OPERATION) if it has not.
    const FinerMesh& adaptedMesh(int32_t instance) const;

  private:
    struct Exchanged;
    struct Results;

    void dropTraces();
    void runAll(const Scene& scene, const Threads& threads);
    void runDraft(const Scene& scene, const Threads& threads);
    void runAdapted(const Scene& scene, const Threads& threads);
    bool scaleDraft(const SourceStrengths& now);
    void keep(Results results);
    // Runs all stages. The report names the first `reportedSets` light sets of the scene. If
    // `adapts` is true, the results hold meshes that follow the light.
    Results runStages(const Scene& scene, size_t reportedSets, const Threads& threads,
                      bool adapts = false);
    void noteWhatIsGiven(const Scene& scene, size_t reportedSets, const Threads& threads,
                         Report& report) const;
    void prepareWorld(const Scene& scene, Report& report);
    void showFirstLight(const Scene& scene, Report& report) const;
    void makePatches(const Scene& scene, Report& report);
    std::vector<CoarseShot> startLines(const Scene& scene, Report& report);
    std::vector<CoarseShot> cutPatches(const Scene& scene, Report& report);
    Exchanged exchange(const SolveInput& in, SetLights& lights, Report& report);
    Transports transportsOf(const SetLights& lights, const ShownLight& shown) const;
    std::vector<InstanceLight> show(const SolveInput& in, const SetLights& lights,
                                    const Exchanged& exchanged, Report& report,
                                    std::vector<FinerMesh>* meshes);
    void noteWhatWasTraced(Report& report) const;

    std::unique_ptr<Trace> trace;              // for the geometry of the last run
    std::unique_ptr<Trace> traceOfSources;     // of the first pass of the last run with two
    std::shared_ptr<const WorldSource> world;  // of the last run, which the next one may use
    std::unique_ptr<DraftLight> draft;         // the last run, if it was a draft that can be scaled
    // Results of the last run per side, see patchIrradiance() and exposedShare().
    Irradiance irradiance;
    std::vector<float> exposed;
    std::vector<InstanceLight> light;
    std::vector<FinerMesh> adapted;  // per instance; empty if the last run adapted no meshes
    std::string json;
    bool ran = false;
    MemoryUse memory;
};

}  // namespace raybundle
