// SPDX-License-Identifier: GPL-3.0-or-later
#include "job/report.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "job/memory.h"

namespace raybundle {
namespace {

// Functions that build JSON text. Only strings and numbers go through nlohmann::json. Its objects
// and arrays allocate in their destructors, which would end the process when memory runs out, so
// that this file joins them as text.
//
// Returns a string or number as JSON.
template <class T>
std::string text(const T& value) {
    // Replace invalid bytes, so that names that are not UTF-8 do not make the report fail.
    return nlohmann::json(value).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// Returns the items separated by commas, between the brackets `first` and `last`.
std::string listed(const std::vector<std::string>& items, char first, char last) {
    std::string joined(1, first);
    for (const std::string& item : items) joined += (joined.size() > 1 ? ",\n" : "") + item;
    return joined + last;
}

// Returns a JSON object of keys and the JSON text of their values.
std::string object(const std::vector<std::pair<const char*, std::string>>& members) {
    std::vector<std::string> items;
    for (const auto& [key, value] : members) items.push_back(text(key) + ": " + value);
    return listed(items, '{', '}');
}

// Returns a JSON array of the texts that `textOf` returns for the items. Empty texts are left out.
template <class Items, class TextOf>
std::string array(const Items& items, const TextOf& textOf) {
    std::vector<std::string> texts;
    for (const auto& item : items)
        if (std::string one = textOf(item); !one.empty()) texts.push_back(std::move(one));
    return listed(texts, '[', ']');
}

double sum(const glm::dvec3& power) { return power.x + power.y + power.z; }

std::string errors(const Report::Errors& error) {
    return object({{"noise", text(error.noise)},
                   {"discretisation", text(error.discretisation)},
                   {"mesh", text(error.mesh)},
                   {"total", text(error.total())}});
}

}  // namespace

double Report::Errors::total() const {
    const double most = std::max(noise, ofPatches);
    return std::sqrt(most * most + discretisation * discretisation + mesh * mesh);
}

double Report::balanceError() const {
    const double emitted = sum(energy.emitted);
    const double lost = emitted - sum(energy.absorbed) - sum(energy.escaped);
    return emitted > 0 ? std::abs(lost) / emitted : 0;
}

size_t Report::adaptiveVertices() const {
    return std::accumulate(
        objects.begin(), objects.end(), size_t(0),
        [](size_t sum, const Object& one) { return sum + one.adaptiveVertices; });
}

void Report::addNotesOf(Report other) {
    warnings.insert(warnings.end(), std::make_move_iterator(other.warnings.begin()),
                    std::make_move_iterator(other.warnings.end()));
    skipped.insert(skipped.end(), other.skipped.begin(), other.skipped.end());
}

std::string Report::json() const {
    return object(
        {{"seconds", object({{"total", text(totalSeconds)},
                             {"patches", text(seconds[RB_STAGE_PATCHES])},
                             {"first_shot", text(seconds[RB_STAGE_FIRST_SHOT])},
                             {"bundles", text(seconds[RB_STAGE_BUNDLES])},
                             {"solve", text(seconds[RB_STAGE_SOLVE])},
                             {"reconstruction", text(seconds[RB_STAGE_RECONSTRUCTION])}})},
         {"patches", text(patches)},
         {"refined", array(cuts,
                           [](const Cut& cut) {
                               return cut.tiles == 0 ? ""
                                                     : object({{"why", text(cut.why)},
                                                               {"tiles", text(cut.tiles)}});
                           })},
         {"bundles", text(bundles)},
         {"lines", text(lines)},
         {"exchanges", text(exchanges)},
         {"shadow_rays", text(shadowRays)},
         {"estimated_error", text(estimatedError)},
         {"error", errors(error)},
         {"energy", object({{"emitted", text(sum(energy.emitted))},
                            {"absorbed", text(sum(energy.absorbed))},
                            {"escaped", text(sum(energy.escaped))},
                            {"balance_error", text(balanceError())}})},
         {"peak_memory_bytes", text(peakResidentMemory())},
         {"adaptive_vertices", text(adaptiveVertices())},
         {"light_sets", array(lightSets,
                              [](const LightSet& set) {
                                  return object({{"name", text(set.name)},
                                                 {"estimated_error", text(set.estimatedError)}});
                              })},
         {"objects", array(objects,
                           [](const Object& one) {
                               return object({{"name", text(one.name)},
                                              {"corners", text(one.corners)},
                                              {"status", text(one.status)},
                                              {"error", errors(one.error)},
                                              {"adaptive_vertices", text(one.adaptiveVertices)}});
                           })},
         {"warnings", array(warnings, [](const Warning& warning) { return text(warning.text); })},
         {"warning_ids",
          array(warnings, [](const Warning& warning) { return text(nameOf(warning.id)); })},
         {"skipped", array(skipped, [](const Skip& skip) {
              const SkippedText& said = textOf(skip.work);
              return skip.count == 0 ? ""
                                     : object({{"id", text(said.id)},
                                               {"what", text(said.what)},
                                               {"why", text(said.why)},
                                               {"count", text(skip.count)}});
          })}});
}

}  // namespace raybundle
