// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/bake_warnings.h"

#include <algorithm>
#include <iomanip>
#include <map>
#include <sstream>

namespace raybundle {
namespace {

// Relative error of the energy balance above which a warning is given.
constexpr double kMostImbalance = 0.01;
// With fewer lines per patch than this, the estimates of the two halves may agree by chance.
constexpr double kFewLines = 16;
constexpr size_t kMostNamed = 20;  // number of objects that a warning names

std::string percent(double share) {
    std::ostringstream text;
    text << std::setprecision(3) << 100 * share << " %";
    return text.str();
}

}  // namespace

void warnOfVisibility(const Scene& scene, const SetLights& lights, const Settings& settings,
                      Report& report) {
    const bool hasDimEmission =
        std::any_of(lights.begin(), lights.end(), [](const SetLight& light) {
            return std::any_of(light.shot.emission.begin(), light.shot.emission.end(),
                               [](const glm::vec3& e) { return e != glm::vec3(0.0f); });
        });
    for (const Instance& instance : scene.instances) {
        const std::string object = "object \"" + instance.name + "\": ";
        if (hasDimEmission && instance.stopsDirect != instance.exchanges)
            report.warn(WarningId::BLOCKS_AS_THE_WORLD,
                        object +
                            "the Ray Visibility settings Shadow and Diffuse differ. The object "
                            "blocks the light of dim emission as it blocks reflected light, not "
                            "as it blocks the light of lamps; switch both settings on or both off "
                            "to avoid this");
        if (!instance.exchanges && instance.role == RB_ROLE_BAKE &&
            !can(settings.solver, SolverCan::LIGHT_WITHOUT_EXCHANGE))
            report.warn(WarningId::NO_EXCHANGE,
                        object + "it does not exchange light with other surfaces. Solver " +
                            choiceName(settings.solver) +
                            " therefore leaves out the light that other surfaces and a constant "
                            "world send to it; choose solver LINE_REUSE");
    }
}

void warnOfTranslucence(const Scene& scene, const Settings& settings, Report& report) {
    if (can(settings.solver, SolverCan::CARRY_TRANSLUCENCE)) return;
    for (const Material& material : scene.materials)
        if (material.isTranslucent())
            report.warn(WarningId::NO_TRANSLUCENCE,
                        "material \"" + material.name + "\": solver " +
                            choiceName(settings.solver) +
                            " does not send the light that passes through this material on to "
                            "other surfaces, which are too dark; choose solver LINE_REUSE");
}

void warnOfAngles(const Patches& patches, const Settings& settings, Report& report) {
    if (patches.byAngle.empty()) return;
    auto warn = [&](const std::string& what, const std::string& remedy) {
        report.warn(WarningId::NO_ANGLES,
                    what +
                        " ignores the angle at which light arrives. Materials whose reflectance "
                        "depends on this angle, such as Principled and rough materials, reflect as "
                        "if light arrived equally from all directions, an error of up to some "
                        "percent; choose " +
                        remedy);
    };
    if (!settings.gathersFirstShot())
        warn(std::string("first_shot ") + choiceName(settings.firstShot), "first_shot GATHER");
    if (!can(settings.solver, SolverCan::CARRY_ANGLES))
        warn(std::string("solver ") + choiceName(settings.solver), "solver LINE_REUSE");
}

void warnOfPatches(size_t patches, const Settings& settings, Report& report) {
    if (patches <= size_t(settings.maxPatches)) return;
    report.warn(WarningId::MAX_PATCHES,
                "the scene needs " + std::to_string(patches) + " patches, more than max_patches (" +
                    std::to_string(settings.maxPatches) +
                    "), so that the bake takes more time and memory. Small faces share patches if "
                    "they are opaque and not translucent, and with the default methods and the "
                    "topology KEEP; simplify the meshes, or increase max_patches");
}

void warnOfGaps(size_t patches, Report& report) {
    if (patches == 0) return;
    report.warn(
        WarningId::UNCUT_GAPS,
        std::to_string(patches) +
            " patches lie beside gaps that are much narrower than a patch, such as below cutlery "
            "on a table. The light in these gaps is too bright; choose solver LINE_REUSE and "
            "first_shot GATHER, with which such patches are cut");
}

void warnOfFewLines(const Scene& scene, const Patches& patches, float pixelSize, uint32_t bundles,
                    const Settings& settings, Report& report) {
    // Counted lines are denser where patches are small. Local rays are not lines of bundles.
    if (settings.countsLines() || !can(settings.solver, SolverCan::TRACE_BUNDLES)) return;
    std::vector<double> area(scene.instances.size(), 0.0), count(area.size(), 0.0);
    for (const Parent& parent : patches.parents) {
        area[parent.instance] += double(parent.area());
        count[parent.instance] += double(parent.patchCount());
    }
    std::string names;
    size_t few = 0;
    for (size_t i = 0; i < area.size(); ++i) {
        if (scene.instances[i].role != RB_ROLE_BAKE || !(count[i] > 0)) continue;
        // The projected area of a flat patch is half of its area, in the mean over all directions.
        const double lines =
            bundles * area[i] / count[i] / (2 * double(pixelSize) * double(pixelSize));
        if (lines < kFewLines && ++few <= kMostNamed)
            names += (few > 1 ? ", \"" : "\"") + scene.instances[i].name + "\"";
    }
    if (few == 0) return;
    if (few > kMostNamed) names += " and " + std::to_string(few - kMostNamed) + " more";
    report.warn(WarningId::FEW_LINES,
                "fewer than " + std::to_string(int(kFewLines)) + " lines meet each patch of " +
                    names + ", so that the noise there may be higher than stated. Solver " +
                    std::string(choiceName(settings.solver)) +
                    " has equally dense lines everywhere; choose solver LINE_REUSE, whose lines "
                    "are denser where patches are small");
}

void warnOfDirectNoise(const Scene& scene, const Patches& patches, const SetLights& lights,
                       const std::vector<float>& area, double noise, double target,
                       Report& report) {
    std::map<std::pair<std::string, uint32_t>, double> variances;  // by source and instance
    for (const SetLight& light : lights) {
        const auto& sources = light.direct.lightSources();
        for (size_t side = 0; side < light.shot.error.size(); ++side) {
            const double error = double(light.shot.error[side]);
            const bool isKnown = !light.shot.noisiest.empty() && !sources.empty();
            variances[{isKnown ? sources[light.shot.noisiest[side]]->name : "the sources",
                       patches.parentAt(uint32_t(side)).instance}] +=
                double(area[side]) * error * error;
        }
    }
    if (variances.empty()) return;
    const auto most =
        std::max_element(variances.begin(), variances.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    report.warn(WarningId::DIRECT_NOISE,
                "the noise is " + percent(noise) + ", above the target of " + percent(target) +
                    ". The largest part of the noise of direct light is in the light of " +
                    most->first.first + " on object \"" + scene.instances[most->first.second].name +
                    "\". More bundles do not reduce it; use smaller patches there (patch_size), or "
                    "move nearby lamps away from the object");
}

void warnOfMissedTarget(const Scene& scene, const MissedTarget& missed, Report& report) {
    const std::string bundles = std::to_string(missed.bundles) + " bundles";
    const bool isCountable = missed.stop != Stop::UNCOUNTABLE_LINES;
    report.warn(isCountable ? WarningId::MAX_BUNDLES : WarningId::UNCOUNTABLE_LINES,
                (isCountable ? "max_bundles was reached at " + bundles + ": "
                             : "the bake stopped at " + bundles +
                                   " because it cannot count the lines of more bundles: ") +
                    "the noise " +
                    (missed.set == kNoLightSet || size_t(missed.set) >= report.lightSets.size()
                         ? ""
                         : "of light set \"" + scene.lightSets[size_t(missed.set)] + "\" ") +
                    "is " + percent(missed.noise) +
                    (missed.ofNoisiest > 0
                         ? ", and at least " + percent(missed.ofNoisiest) + " on the noisiest parts"
                         : "") +
                    "; the target is " + percent(missed.target) +
                    (isCountable ? ". Increase max_bundles to reach the target"
                                 : ". Reduce lines_per_bundle, or increase target_error"));
}

void warnOfBrokenCycles(uint64_t cycles, Report& report) {
    if (cycles == 0) return;
    report.warn(WarningId::BROKEN_CYCLES,
                std::to_string(cycles) +
                    " times, patches covered each other in a cycle, which no drawing order can "
                    "solve. Some lines therefore meet surfaces in the wrong order; choose "
                    "projector AUTO, which needs no drawing order");
}

void warnOfWrongExchanges(double share, double error, Report& report) {
    report.warn(WarningId::WRONG_EXCHANGES,
                percent(share) +
                    " of the lines met surfaces in a wrong order or passed through surfaces. The "
                    "error of the light is about " +
                    percent(error) +
                    ", and more bundles do not reduce it; choose projector AUTO and small_patches "
                    "CENTRE_SAMPLING");
}

void warnOfImbalance(Report& report) {
    if (!(report.balanceError() > kMostImbalance)) return;
    report.warnings.insert(
        report.warnings.begin(),
        {WarningId::ENERGY_BALANCE,
         "the energy balance is off by " + percent(report.balanceError()) +
             ": this share of the emitted light is lost or added, and the result may be wrong by "
             "as much. Look for lamps that are inside other surfaces or touch them, and compare "
             "with a bake of smaller patches (patch_size)"});
}

}  // namespace raybundle
