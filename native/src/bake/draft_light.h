// SPDX-License-Identifier: GPL-3.0-or-later
//
// The light of a draft, kept while the strengths of some sources change. A draft in which nothing
// else has changed takes the light of these sources apart from the rest. From then on, their light
// is scaled instead of computed.
//
// Source: thesis section 2.1.4 (the radiosity system is linear in the emission).
// Differs: the result at the corners is scaled. It is nearly linear too: the reconstruction keeps
// values within the range of the light around them, for the two parts separately.
#pragma once

#include <optional>
#include <vector>

#include "bake/source_strengths.h"
#include "job/report.h"
#include "reconstruction/instance_light.h"
#include "transport/set_light.h"

namespace raybundle {

// The light of the sources that are apart, with the strengths of the draft.
struct LightApart {
    std::vector<size_t> sources;
    std::vector<CornerLight> atCorners;     // per instance
    std::vector<std::vector<float>> error;  // per instance and corner, of all light
    Irradiance onSides;
    Report::Energy energy;
    glm::dvec3 factor{1.0};  // that the light has been scaled by since the draft
    bool mayGrow = true;     // whether the light is far from the limits of float
};

// The last draft.
class DraftLight {
  public:
    // Returns whether drafts with these settings can be scaled: whether light sets can have light
    // of their own.
    static bool isPossible(const Settings& settings);

    // Keeps a draft with these strengths.
    DraftLight(const SourceStrengths& strengths, const Report& report)
        : strengths(strengths), present(strengths), report(report) {}

    // Takes the light of a parted scene apart: moves that of its light set from `light` to this
    // object. `sources` are those apart (SourceStrengths), `ofSources` is their light on patch
    // sides, and `energy` their part of the energy of the report. Call this at most once.
    void part(std::vector<size_t> sources, const Irradiance& ofSources,
              const Report::Energy& energy, std::vector<InstanceLight>& light);

    // Returns the sources that should be put apart, because nothing but their strengths has changed
    // since this draft was made or scaled. Empty: there are none, or something else has changed.
    std::vector<size_t> sourcesToPart(const SourceStrengths& now) const;

    // Makes this a draft with other strengths: scales the light at corners and on patch sides,
    // which keeps its relative errors. Returns its report, without times. Returns nothing, and
    // changes nothing, if something else has changed, or if strengths have grown so much that the
    // light may overflow.
    std::optional<Report> scale(const SourceStrengths& now, std::vector<InstanceLight>& light,
                                Irradiance& irradiance);

  private:
    void scaleInstance(size_t instance, const glm::dvec3& factor, InstanceLight& light) const;

    SourceStrengths strengths;  // with which the draft was made
    SourceStrengths present;    // to which it has been scaled
    Report report;              // of the draft as it was made
    std::optional<LightApart> parted;
};

}  // namespace raybundle
