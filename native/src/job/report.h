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

// What a bake reports: times, counts, errors, warnings and skipped work. json() is its text.
struct Report {
    // Parts of the stated error: relative RMS, weighted by exposed area.
    // stated_error/stated_error.h defines what each part covers.
    struct Errors {
        double noise = 0, discretisation = 0, mesh = 0;
        double ofPatches = 0;  // noise of the light on patches; `noise` is that at corners
        // Returns the root of the sum of the squares of the parts. Noise counts with the larger of
        // `noise` and `ofPatches`, to be on the safe side.
        double total() const;
    };
    // The result of one object.
    struct Object {
        std::string name;
        size_t corners = 0;
        std::string status;
        Errors error{};  // relative to the object's own light
        // Number of vertices that its mesh has if it is adapted to the light. 0: not counted.
        size_t adaptiveVertices = 0;
    };
    // The power that sources emit, that surfaces absorb, and that leaves the scene, W, RGB.
    struct Energy {
        glm::dvec3 emitted{0.0}, absorbed{0.0}, escaped{0.0};

        // Adds `factor` times another energy, by channel.
        void add(const Energy& other, const glm::dvec3& factor = glm::dvec3(1.0)) {
            emitted += factor * other.emitted;
            absorbed += factor * other.absorbed;
            escaped += factor * other.escaped;
        }
    };
    // Work that was left out, and how many times.
    struct Skip {
        SkippedWork work;
        uint64_t count;
    };
    // Number of tiles that were cut into smaller patches for one reason, such as "narrow gap".
    struct Cut {
        std::string why;
        uint64_t tiles = 0;
    };
    // The result of one light set.
    struct LightSet {
        std::string name;
        double estimatedError = 0;  // relative noise
    };
    std::array<double, 5> seconds{};  // per rb_stage
    double totalSeconds = 0;
    size_t patches = 0;
    std::vector<Cut> cuts;  // tiles that were cut into patches
    uint32_t bundles = 0;
    uint64_t lines = 0;
    size_t exchanges = 0;  // distinct pairs of patch sides that exchange light
    uint64_t shadowRays = 0;
    double estimatedError = 0;  // relative noise of the irradiance on patch sides
    Errors error;               // of the shown light
    Energy energy;
    std::vector<LightSet> lightSets;
    std::vector<Object> objects;
    Warnings warnings;
    std::vector<Skip> skipped;

    // Adds a warning.
    void warn(WarningId id, std::string text) { warnings.push_back({id, std::move(text)}); }
    // Notes that work was left out `count` times. The report leaves out entries whose count is 0.
    void skip(SkippedWork work, uint64_t count) { skipped.push_back({work, count}); }
    // Appends the warnings and the skipped work of another report.
    void addNotesOf(Report other);

    // Returns the number of vertices that all meshes have if they are adapted to the light, or 0 if
    // they were not counted.
    size_t adaptiveVertices() const;
    // Returns |emitted - absorbed - escaped| / emitted, each summed over the channels, or 0 if
    // nothing is emitted.
    double balanceError() const;
    // Returns the report as UTF-8 JSON. docs/c_api.md lists its keys. Its peak memory is that of
    // the process at the time of the call.
    std::string json() const;
};

}  // namespace raybundle
