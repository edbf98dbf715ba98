// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/report.h"

#include <sys/resource.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace raybundle {
namespace {

// Of the whole process so far.
int64_t peakMemoryBytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return int64_t(usage.ru_maxrss) * 1024;
}

nlohmann::ordered_json toJson(const Report::Errors& error) {
    return {{"noise", error.noise},
            {"discretisation", error.discretisation},
            {"mesh", error.mesh},
            {"total", error.total()}};
}

}  // namespace

double Report::Errors::total() const {
    return std::sqrt(noise * noise + discretisation * discretisation + mesh * mesh);
}

double Report::balanceError() const {
    return emitted > 0 ? std::abs(emitted - absorbed - escaped) / emitted : 0;
}

std::string Report::json() const {
    using nlohmann::ordered_json;
    ordered_json seconds_;
    seconds_["total"] = totalSeconds;
    seconds_["patches"] = seconds[RB_STAGE_PATCHES];
    seconds_["first_shot"] = seconds[RB_STAGE_FIRST_SHOT];
    seconds_["bundles"] = seconds[RB_STAGE_BUNDLES];
    seconds_["solve"] = seconds[RB_STAGE_SOLVE];
    seconds_["reconstruction"] = seconds[RB_STAGE_RECONSTRUCTION];
    ordered_json objects_ = ordered_json::array(), skipped_ = ordered_json::array(),
                 lightSets_ = ordered_json::array(), cuts_ = ordered_json::array();
    for (const Cut& cut : cuts)
        if (cut.tiles > 0) cuts_.push_back({{"why", cut.why}, {"tiles", cut.tiles}});
    for (const LightSet& set : lightSets)
        lightSets_.push_back({{"name", set.name}, {"estimated_error", set.estimatedError}});
    for (const Object& object : objects)
        objects_.push_back({{"name", object.name},
                            {"corners", object.corners},
                            {"status", object.status},
                            {"error", toJson(object.error)}});
    for (const Skip& skip : skipped)
        if (skip.count > 0)
            skipped_.push_back({{"what", skip.what}, {"why", skip.why}, {"count", skip.count}});
    const ordered_json report = {{"seconds", seconds_},
                                 {"patches", patches},
                                 {"refined", cuts_},
                                 {"bundles", bundles},
                                 {"lines", lines},
                                 {"exchanges", exchanges},
                                 {"shadow_rays", shadowRays},
                                 {"estimated_error", estimatedError},
                                 {"error", toJson(error)},
                                 {"energy",
                                  {{"emitted", emitted},
                                   {"absorbed", absorbed},
                                   {"escaped", escaped},
                                   {"balance_error", balanceError()}}},
                                 {"peak_memory_bytes", peakMemoryBytes()},
                                 {"light_sets", lightSets_},
                                 {"objects", objects_},
                                 {"warnings", warnings},
                                 {"skipped", skipped_}};
    // Names that are not UTF-8 must not lose the report.
    return report.dump(2, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace raybundle
