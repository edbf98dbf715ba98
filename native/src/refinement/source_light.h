// SPDX-License-Identifier: GPL-3.0-or-later
//
// The light that points on faces get straight from all sources of a bake.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "job/progress.h"
#include "job/report.h"
#include "lights/receiver.h"
#include "refinement/face_light.h"

namespace raybundle {

struct SourceLight {
    std::vector<glm::vec3> light;  // per receiver: as it is shown, W/m^2
    std::vector<float> variance;   // per receiver: of the brightest channel, (W/m^2)^2
};

// Gathers the light of the sources at receivers, with a relative error of about `targetError`. Adds
// the shadow rays to the report.
SourceLight gatherSources(const KnownLight& known, const std::vector<Receiver>& receivers,
                          float targetError, const Progress& progress, Report& report);

// A point on a face of an instance, and the seed of its samples.
struct FacePlace {
    int32_t face;
    glm::dvec3 at;  // m, relative to Patches::centre
    uint32_t seed;
};

// Gathers the light of the sources on the faces of one instance.
class SourceSampler {
  public:
    // The relative error of the light is about `targetError`. References must outlive the object.
    SourceSampler(const KnownLight& known, const FaceLight& faces, float targetError,
                  const Progress& progress, Report& report)
        : known(known),
          faces(faces),
          targetError(targetError),
          progress(progress),
          report(report) {}

    // Returns the light at places, W/m^2; empty where it is not gathered: where another surface
    // covers the face, and for a place that is not a number.
    std::vector<std::optional<glm::vec3>> at(const std::vector<FacePlace>& places);
    // Returns whether another surface covers a place.
    bool isCovered(const FacePlace& place) const { return !receiverAt(place); }

  private:
    std::optional<Receiver> receiverAt(const FacePlace& place) const;

    const KnownLight& known;
    const FaceLight& faces;
    const float targetError;
    const Progress& progress;
    Report& report;
};

}  // namespace raybundle
