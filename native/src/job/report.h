// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <utility>
#include <vector>

#include "job/skipped_work.h"
#include "job/warning.h"
#include "raybundle/raybundle.h"

namespace raybundle {

struct Report {
    // Relative RMS by exposed area; what each covers: stated_error/stated_error.h.
    struct Errors {
        double noise = 0, discretisation = 0, mesh = 0;
        double ofPatches = 0;  // the noise of the patches, of which `noise` is shown
        double total() const;  // with that: on the safe side
    };
    struct Object {
        std::string name;
        size_t corners = 0;
        std::string status;
        Errors error{};  // relative to the object's own light
    };
    struct Skip {
        SkippedWork work;
        uint64_t count;
    };
    struct Cut {
        std::string why;
        uint64_t tiles = 0;
    };
    struct LightSet {
        std::string name;
        double estimatedError = 0;  // relative noise
    };
    std::array<double, 5> seconds{};  // per rb_stage
    double totalSeconds = 0;
    size_t patches = 0;
    std::vector<Cut> cuts;  // of tiles into patches
    uint32_t bundles = 0;
    uint64_t lines = 0;
    size_t exchanges = 0;  // merged pairs of patch sides
    uint64_t shadowRays = 0;
    double estimatedError = 0;                      // relative noise of the patch sides
    Errors error;                                   // of what is shown
    double emitted = 0, absorbed = 0, escaped = 0;  // W, sum of the channels
    std::vector<LightSet> lightSets;
    std::vector<Object> objects;
    Warnings warnings;
    std::vector<Skip> skipped;

    void warn(WarningId id, std::string text) { warnings.push_back({id, std::move(text)}); }
    // Notes that `count` times such work was left out; 0 leaves no line in the report.
    void skip(SkippedWork work, uint64_t count) { skipped.push_back({work, count}); }
    // Appends the warnings and the skipped work of another report.
    void addNotesOf(Report other);

    // |emitted - absorbed - escaped| / emitted
    double balanceError() const;
    // The whole report; keys as in docs/c_api.md.
    std::string json() const;
};

}  // namespace raybundle
