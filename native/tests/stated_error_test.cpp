// SPDX-License-Identifier: GPL-3.0-or-later
//
// The stated error and its parts, against closed forms and over many seeds.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "lights/mesh_outline.h"
#include "reconstruction/reconstruction.h"
#include "stated_error/surplus.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// Returns the grid with every quad divided in two.
Mesh halved(const Mesh& quads) {
    std::vector<std::vector<int32_t>> faces;
    for (size_t f = 0; f < quads.faceCount(); ++f) {
        const int32_t* c = quads.cornerVertices.data() + 4 * f;
        faces.insert(faces.end(), {{c[0], c[1], c[2]}, {c[0], c[2], c[3]}});
    }
    return polygons(quads.name, quads.vertices, faces);
}

using LightAt = std::function<double(glm::dvec3)>;

// Grey light of the sources on a mesh, as patches have it: exact means of kSteps^2 points on each
// patch.
class LitMesh {
  public:
    LitMesh(Mesh mesh, float patchSize, LightAt at) : at(std::move(at)) {
        Scene scene;
        place(scene, std::move(mesh), grey("", 0.5f));
        patches = subdivide(scene, patchSize, kMany);
        irradiance = Irradiance(patches.sideCount());
        for (uint32_t p = 0; p < patches.count(); ++p) {
            double mean = 0;
            forEachPoint(p, [&](glm::dvec2, double light) { mean += light; });
            irradiance.direct[2 * p] = irradiance.ofSources[2 * p] =
                glm::vec3(float(mean / (kSteps * kSteps)));
        }
    }

    // Returns the distance of the light from the best linear function on each patch, RMS over all
    // patches, per channel.
    double distanceFromLinear() const {
        double squares = 0;
        for (uint32_t p = 0; p < patches.count(); ++p) {
            double sum = 0, square = 0;
            glm::dvec2 moment(0.0);
            // Offsets from the centre are uncorrelated on a parallelogram.
            forEachPoint(p, [&](glm::dvec2 uv, double light) {
                sum += light;
                square += light * light;
                moment += (uv - 0.5) * light;
            });
            const double n = kSteps * kSteps, spread = (1 - 1 / (double(kSteps) * kSteps)) / 12;
            squares += square / n - sum / n * sum / n - glm::dot(moment / n, moment / n) / spread;
        }
        return std::sqrt(std::max(0.0, squares) / double(patches.count()));
    }

    // Returns the surplus that surplusOf estimates, RMS over all patches, per channel.
    double surplus() const {
        const std::vector<float> exposed(patches.sideCount(), 1.0f);
        const std::vector<float> noError(patches.sideCount(), 0.0f);
        const std::vector<Surplus> found =
            surplusOf({patches, exposed}, 0, uint32_t(patches.parents.size()), RB_SIDE_FRONT,
                      irradiance, noError);
        double squares = 0, known = 0;
        for (const Surplus& s : found) {
            if (!s.isKnown) continue;
            squares += double(s.smooth + s.step);
            ++known;
        }
        EXPECT_GT(known, 0.9 * double(found.size()));
        return std::sqrt(squares / known / 3);
    }

  private:
    static constexpr int kSteps = 24;

    template <class Body>
    void forEachPoint(uint32_t patch, const Body& body) const {
        const bool isTriangle = patches.parents[patches.parentOf[patch]].isTriangle;
        for (int i = 0; i < kSteps; ++i)
            for (int j = 0; j < kSteps; ++j) {
                glm::dvec2 uv((i + 0.5) / kSteps, (j + 0.5) / kSteps);
                // For a triangle only the centroid, which suffices for linear light.
                if (isTriangle) uv = glm::dvec2(1.0 / 3);
                const glm::dvec3 point =
                    glm::dvec3(patches.point(patch, glm::vec2(uv))) + patches.centre;
                body(uv, at(point));
            }
    }

    LightAt at;
    Patches patches;
    Irradiance irradiance;
};

Mesh square(int n) { return grid("square", {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, n, n); }

TEST(Surplus, LinearLightHasNone) {
    for (const Mesh& mesh : {square(1), square(3), square(40), halved(square(4))}) {
        const LitMesh lit(mesh, 0.1f, [](glm::dvec3 p) { return 3 + 0.5 * p.x - 0.25 * p.y; });
        EXPECT_LT(lit.surplus(), 1e-5) << mesh.faceCount() << " faces";
    }
}

TEST(Surplus, PointLightOverAPlaneIsKnownWithinAFactorOfTwo) {
    // The light is 0.7 m above the square, off its centre. The patches have edges of 0.18 to 0.71
    // of this height.
    const LightAt light = [](glm::dvec3 p) {
        const glm::dvec3 d = glm::dvec3(0.3, -0.2, 0.7) - p;
        return d.z / std::pow(glm::length(d), 3);
    };
    double last = 0;
    for (float patchSize : {0.125f, 0.25f, 0.5f})
        for (int faces : {1, 8}) {
            const LitMesh lit(square(faces), patchSize, light);
            const double truth = lit.distanceFromLinear(), found = lit.surplus();
            EXPECT_GT(found, 0.5 * truth) << patchSize << " m, " << faces;
            EXPECT_LT(found, 2 * truth) << patchSize << " m, " << faces;
            EXPECT_GE(found, 0.9 * last);
            last = found;
        }
}

TEST(Surplus, ShadowEdgesAreKnownWithinAFactorOfTwo) {
    for (float patchSize : {0.0625f, 0.125f, 0.25f}) {
        double truth = 0, found = 0;
        // The position of the edge relative to the grid is random, so the mean over several
        // positions is compared.
        for (int k = 0; k < 8; ++k)
            for (double angle : {0.0, 0.3, 0.7}) {
                const double cosine = std::cos(angle), sine = std::sin(angle);
                const LitMesh lit(square(1), patchSize, [=](glm::dvec3 p) {
                    const double across = cosine * p.x + sine * p.y;
                    return across < 0.1 + 0.031 * k ? 1.0 : 0.2;
                });
                truth += std::pow(lit.distanceFromLinear(), 2);
                found += std::pow(lit.surplus(), 2);
            }
        EXPECT_GT(std::sqrt(found), 0.5 * std::sqrt(truth)) << patchSize;
        EXPECT_LT(std::sqrt(found), 2 * std::sqrt(truth)) << patchSize;
    }
}

Json errorsOf(const Scene& scene, float patchSize) {
    Bake bake;
    bake.settings.patchSize = patchSize;
    bake.settings.targetError = 0.005f;
    bake.settings.maxBundles = 64;
    bake.run(scene);
    return reportOf(bake);
}

TEST(StatedError, IsNothingInAFurnace) {
    const Json report = errorsOf(closedCube(0.5f, 0.5f), 0.1f);
    for (const char* part : {"noise", "discretisation", "mesh", "total"}) {
        EXPECT_LT(double(report["error"][part]), 1e-5) << part;
        EXPECT_LT(double(report["objects"][0]["error"][part]), 1e-5) << part;
    }
}

// A ground below a square lamp of 1 m, 1 m above its centre. Nothing reflects, and nothing blocks
// the light.
Scene groundBelowLamp(int faces) {
    Scene scene;
    place(scene, square(faces), grey("", 0));
    scene.addLight(areaLight({0, 0, 1}, {0, 0.5, 0}, {0.5, 0, 0}, {1, 1, 1}));
    return scene;
}

// Returns the surface error at a grid of points on each face.
double surfaceError(const Scene& scene, const Bake& bake) {
    const glm::dvec3 lamp[4] = {{-0.5, -0.5, 1}, {0.5, -0.5, 1}, {0.5, 0.5, 1}, {-0.5, 0.5, 1}};
    const Mesh& mesh = scene.meshes[0];
    const std::vector<glm::vec3> light = cornerLight(bake, 0, RB_OUTPUT_LIGHTING);
    double squares = 0, signal = 0;
    constexpr int kSteps = 8;
    for (size_t f = 0; f < mesh.faceCount(); ++f)
        for (int i = 0; i < kSteps; ++i)
            for (int j = 0; j < kSteps; ++j) {
                const double s = (i + 0.5) / kSteps, t = (j + 0.5) / kSteps;
                const double w[4] = {(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t};
                glm::dvec3 point(0.0);
                double shown = 0;
                for (size_t k = 0; k < 4; ++k) {
                    const size_t c = 4 * f + k;
                    point += w[k] * glm::dvec3(mesh.vertices[size_t(mesh.cornerVertices[c])]);
                    shown += w[k] * kPi * double(light[c].x);
                }
                const double exact = polygonIrradiance(glm::vec3(point), {0, 0, 1}, lamp, 4);
                squares += (shown - exact) * (shown - exact);
                signal += exact * exact;
            }
    return std::sqrt(squares / signal);
}

TEST(StatedError, IsTheSurfaceErrorWithinAFactorOfTwo) {
    for (const auto& [faces, patchSize] :
         {std::make_pair(4, 0.1f), {8, 0.1f}, {8, 0.5f}, {16, 0.25f}}) {
        const Scene scene = groundBelowLamp(faces);
        Bake bake;
        bake.settings.patchSize = patchSize;
        bake.settings.targetError = 0.002f;
        bake.run(scene);
        const double truth = surfaceError(scene, bake);
        const double stated = reportOf(bake)["error"]["total"];
        EXPECT_GT(stated, 0.8 * truth) << faces << " faces, patches of " << patchSize;
        EXPECT_LT(stated, 2 * truth) << faces << " faces, patches of " << patchSize;
    }
}

TEST(StatedError, NamesCoarseObjectsAndTheEdgesTheyNeed) {
    const Json report = errorsOf(groundBelowLamp(3), 0.1f);
    ASSERT_TRUE(mentions(report["warnings"], "object \\\"square\\\"")) << report["warnings"];
    EXPECT_TRUE(mentions(report["warnings"], "ADAPTIVE"));
    EXPECT_GT(double(report["error"]["mesh"]), 0.05);
    // The warning promises an error of 5 % with the edges that it names.
    const std::string text = report["warnings"][0];
    const size_t at = text.find("Edges of about ");
    ASSERT_NE(at, std::string::npos) << text;
    const double edge = std::stod(text.substr(at + 15));
    const Json finer = errorsOf(groundBelowLamp(int(std::ceil(4 / edge))), 0.1f);
    EXPECT_LT(double(finer["error"]["mesh"]), 1.5 * 0.05) << edge;
    EXPECT_GT(double(finer["error"]["mesh"]), 0.3 * 0.05) << edge;
    EXPECT_FALSE(mentions(errorsOf(groundBelowLamp(24), 0.1f)["warnings"], "too coarse"));
}

TEST(StatedError, NamesTheWorstOfManyCoarseObjects) {
    // Ten grounds in a row, each below its own lamp. Each lamp is brighter than the one before.
    Scene scene;
    for (int k = 0; k < 10; ++k) {
        const float x = 20.0f * float(k);
        place(scene, grid("ground" + std::to_string(k), {x - 2, -2, 0}, {4, 0, 0}, {0, 4, 0}, 2, 2),
              grey("", 0));
        scene.addLight(pointLight({x, 0, 0.5}, glm::dvec3(10 + k)));
    }
    const Json warnings = errorsOf(scene, 0.1f)["warnings"];
    EXPECT_FALSE(mentions(warnings, "ground3"));
    for (const char* name : {"ground4", "ground5", "ground6", "ground7", "ground8", "ground9"})
        EXPECT_TRUE(mentions(warnings, name)) << name;
    EXPECT_TRUE(mentions(warnings, "4 more objects are too coarse"));
}

// Tests the noise on the patch sides, and at the corners, which is the noise that is shown. A bake
// states its noise from the difference of two halves. This difference is sometimes small by chance,
// and the bundles then stop. At most 5 % of the bakes may have more than 1.25 times the noise that
// they state. If exactly 5 % do, more than 8 of 60 bakes do with a probability of 0.3 %.
TEST(StatedError, CoversTheNoiseOverManySeeds) {
    constexpr int kSeeds = 60, kMost = 8;
    const Scene scene = litRoom();
    struct Light {
        std::vector<glm::vec3> ofSides, ofCorners;  // times the square root of the area
        double stated = 0, shown = 0;
    };
    std::vector<Light> lights(kSeeds);
    for (int seed = 0; seed < kSeeds; ++seed) {
        Bake bake;
        bake.settings.patchSize = 0.3f;
        bake.settings.minBundles = 16;
        bake.settings.targetError = 0.04f;
        bake.settings.contacts = 0;  // the noise is stated for whole tiles
        bake.settings.seed = seed;
        bake.run(scene);
        const Irradiance& found = bake.patchIrradiance();
        const Patches& patches = bake.patches();
        Light& light = lights[size_t(seed)];
        for (uint32_t side = 0; side < found.direct.size(); side += 2)
            light.ofSides.push_back(std::sqrt(patches.area[side / 2]) *
                                    (found.direct[side] + found.indirect[side]));
        const std::vector<InstanceRange> ranges = instanceRanges(scene, patches);
        for (size_t i = 0; i < ranges.size(); ++i) {
            const auto own = cornerLight(bake, int32_t(i), RB_OUTPUT_LIGHTING);
            for (uint32_t c = ranges[i].firstCell; c < ranges[i].lastCell; ++c) {
                const Cell& cell = patches.cells[c];
                const float area = float(cell.area()) / float(cell.cornerCount());
                for (const int32_t corner : cell.corner)
                    if (corner >= 0)
                        light.ofCorners.push_back(std::sqrt(area) * own[size_t(corner)]);
            }
        }
        light.stated = reportOf(bake)["estimated_error"];
        light.shown = reportOf(bake)["error"]["noise"];
    }
    // The ratio of true to stated noise, per seed.
    auto ratios = [&](std::vector<glm::vec3> Light::*values, double Light::*stated) {
        std::vector<glm::vec3> mean((lights[0].*values).size(), glm::vec3(0.0f));
        for (const Light& light : lights)
            for (size_t i = 0; i < mean.size(); ++i) mean[i] += (light.*values)[i] / float(kSeeds);
        std::vector<double> result;
        for (const Light& light : lights)
            // Each bake is a part of the mean, which reduces its difference from the mean.
            result.push_back(noise(light.*values, mean) / std::sqrt(1 - 1.0 / kSeeds) /
                             (light.*stated));
        return result;
    };
    const std::vector<double> ofSides = ratios(&Light::ofSides, &Light::stated);
    EXPECT_LE(std::count_if(ofSides.begin(), ofSides.end(), [](double r) { return r > 1.25; }),
              kMost);
    // The cells are whole walls here. One difference of halves at their few corners determines the
    // noise only within a factor of two. In the root mean square over the seeds the stated noise is
    // right.
    double squares = 0;
    for (double r : ratios(&Light::ofCorners, &Light::shown)) squares += r * r / kSeeds;
    EXPECT_GT(std::sqrt(squares), 1 / 1.5);
    EXPECT_LT(std::sqrt(squares), 1 / 0.7);
}

TEST(StatedError, HasAValuePerCorner) {
    const Scene scene = groundBelowLamp(4);
    Bake bake;
    bake.settings.patchSize = 0.1f;
    bake.run(scene);
    const InstanceLight& light = bake.instanceLight(0);
    ASSERT_EQ(light.error.size(), scene.meshes[0].cornerCount());
    // The error is larger below the lamp than at the border.
    EXPECT_GT(light.error[4 * 5 + 2], 2 * light.error[0]);
    EXPECT_GT(light.error[0], 0);
}

}  // namespace
}  // namespace raybundle
