// SPDX-License-Identifier: GPL-3.0-or-later
//
// MULTIPATH against exact solutions and against LINE_REUSE.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "bake/error.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

struct MultipathBake : Bake {
    MultipathBake(const Scene& scene, int bundleCount, int seed, float patchSize,
                  const char* solver = "MULTIPATH", const char* directions = "RANDOM") {
        settings.solver = solver;
        settings.directions = directions;
        settings.patchSize = patchSize;
        settings.minBundles = settings.maxBundles = bundleCount;
        settings.targetError = 1e-5f;
        settings.seed = seed;
        run(scene);
    }
    double statedError() const { return reportOf(*this)["estimated_error"]; }
};

// Relative RMS difference of the irradiance on all fronts, weighted by area.
double fieldError(const Bake& bake, const Bake& reference) {
    const Patches& patches = bake.patches();
    double difference = 0, signal = 0;
    for (size_t i = 0; i < patches.sideCount(); i += 2) {
        const Irradiance &a = bake.patchIrradiance(), &b = reference.patchIrradiance();
        const glm::vec3 d = a.direct[i] + a.indirect[i] - b.direct[i] - b.indirect[i];
        const glm::vec3 r = b.direct[i] + b.indirect[i];
        difference += double(patches.area[i / 2] * glm::dot(d, d));
        signal += double(patches.area[i / 2] * glm::dot(r, r));
    }
    return std::sqrt(difference / signal);
}

// A closed cube with one patch a face, of which the lowest emits 1.
Scene cubeWithOneSource(float reflectance) {
    Scene scene = closedCube(reflectance);
    const int32_t lit = scene.addMaterial(grey("lit", reflectance, 1));
    Mesh& mesh = scene.mesh(0);
    mesh.faceMaterials[0] = lit;
    return scene;
}

// Of a value over seeds.
struct Sample {
    double sum = 0, squares = 0;
    int count = 0;

    void add(double value) {
        sum += value;
        squares += value * value;
        ++count;
    }
    double mean() const { return sum / count; }
    double standardError() const {
        return std::sqrt((squares / count - mean() * mean()) / (count - 1));
    }
};

// Of 200 seeds the mean is within 3 standard errors with probability 0.997.
constexpr int kSeeds = 200;

TEST(Multipath, IsUnbiasedInACube) {
    // By the eigenvalues of a cube's form factors: emitter, opposite, sides at reflectance 0.5.
    constexpr double kEmitter = 1.0909090981, kOpposite = 0.1817458261, kSide = 0.1818362689;
    const Scene scene = cubeWithOneSource(0.5f);
    std::array<Sample, 6> exitance;
    for (int seed = 0; seed < kSeeds; ++seed) {
        const MultipathBake bake(scene, 64, seed, 10);
        ASSERT_EQ(bake.patches().count(), 6u);
        const Irradiance& h = bake.patchIrradiance();
        for (size_t f = 0; f < 6; ++f)
            exitance[f].add(double(bake.patches().emission[2 * f].x) +
                            0.5 * double(h.direct[2 * f].x + h.indirect[2 * f].x));
    }
    for (size_t f = 0; f < 6; ++f) {
        const double exact = f == 0 ? kEmitter : f == 1 ? kOpposite : kSide;
        EXPECT_NEAR(exitance[f].mean(), exact, 3 * exitance[f].standardError()) << "face " << f;
    }
}

TEST(Multipath, IsUnbiasedInARoomWithBoxes) {
    const Scene scene = litRoom(0.6f);
    const MultipathBake reference(scene, 8192, 999, 0.8f, "LINE_REUSE", "LOW_DISCREPANCY");
    // Mean irradiance of each object; the ambient term's own error falls below the noise from some
    // hundred bundles on.
    const size_t objects = scene.instances.size();
    auto meansOf = [&](const Bake& bake) {
        std::vector<double> light(objects, 0), area(objects, 0);
        const Patches& patches = bake.patches();
        for (size_t i = 0; i < patches.sideCount(); i += 2) {
            const uint32_t object = patches.parents[patches.parentOf[i / 2]].instance;
            const Irradiance& h = bake.patchIrradiance();
            light[object] += double(patches.area[i / 2]) * double(h.direct[i].x + h.indirect[i].x);
            area[object] += double(patches.area[i / 2]);
        }
        for (size_t k = 0; k < objects; ++k) light[k] /= area[k];
        return light;
    };
    std::vector<Sample> means(objects);
    for (int seed = 0; seed < kSeeds; ++seed) {
        const std::vector<double> found = meansOf(MultipathBake(scene, 128, seed, 0.8f));
        for (size_t k = 0; k < objects; ++k) means[k].add(found[k]);
    }
    const std::vector<double> exact = meansOf(reference);
    // The reference has 0.1 % noise.
    for (size_t k = 0; k < objects; ++k)
        EXPECT_NEAR(means[k].mean(), exact[k], 3 * means[k].standardError() + 1e-3 * exact[k])
            << scene.instances[k].name;
}

TEST(Multipath, ConvergesToTheSolutionOfLineReuseWithinTheStatedError) {
    const Scene scene = litRoom(0.6f);
    const MultipathBake reference(scene, 8192, 999, 0.3f, "LINE_REUSE", "LOW_DISCREPANCY");
    for (int bundles : {64, 256, 1024}) {
        const MultipathBake bake(scene, bundles, 1, 0.3f);
        // The stated error is that of one pair of halves, whose patches share their directions: a
        // factor of 2 either way is within its scatter.
        EXPECT_LT(fieldError(bake, reference), 2 * bake.statedError()) << bundles;
        EXPECT_LT(bake.statedError(), 1.6 / std::sqrt(bundles));
    }
}

TEST(Multipath, AFurnaceIsRightWithinTheStatedError) {
    const Scene scene = roomWithBoxes(0.5f, 0.5f, 0);
    const MultipathBake bake(scene, 512, 3, 0.5f);
    const Patches& patches = bake.patches();
    double squares = 0, area = 0;
    for (size_t i = 0; i < patches.sideCount(); i += 2) {
        const glm::vec3 h = bake.patchIrradiance().direct[i] + bake.patchIrradiance().indirect[i];
        if (h.x == 0) continue;  // wholly covered: the bottoms of the boxes
        squares += double(patches.area[i / 2]) * double(h.x - 1) * double(h.x - 1);
        area += double(patches.area[i / 2]);
    }
    EXPECT_LT(std::sqrt(squares / area), 2 * bake.statedError());
    EXPECT_LT(bake.statedError(), 0.1);
}

TEST(Multipath, AnOpenSceneBalancesItsEnergy) {
    Scene scene = litRoom(0.6f);
    scene.instances[0].transform = glm::dmat4(1);
    Mesh& room = scene.meshes[0];
    // Without its first face the room is open.
    room.cornerVertices.erase(room.cornerVertices.begin(), room.cornerVertices.begin() + 4);
    room.faceOffsets.pop_back();
    room.faceMaterials.pop_back();
    scene.worldRadiance = {0.2f, 0.2f, 0.2f};
    const MultipathBake bake(scene, 2048, 3, 0.5f);
    EXPECT_LT(reportOf(bake)["energy"]["balance_error"].get<double>(), bake.statedError());
}

TEST(Multipath, ThePseudoCodeOfTheThesisDoesNotConverge) {
    const Scene scene = litRoom(0.6f);
    const MultipathBake reference(scene, 8192, 999, 0.3f, "LINE_REUSE", "LOW_DISCREPANCY");
    const MultipathBake corrected(scene, 4096, 1, 0.3f);
    Bake literal;
    literal.settings = corrected.settings;
    literal.settings.thesisLiteral = 1;
    literal.run(scene);
    EXPECT_GT(fieldError(literal, reference), 3 * fieldError(corrected, reference));
}

TEST(Multipath, TheNumberOfThreadsDoesNotMatter) {
    const Scene scene = litRoom(0.6f);
    auto lightWith = [&](int threads) {
        Bake bake;
        bake.settings = MultipathBake(scene, 64, 1, 0.5f).settings;
        bake.settings.threads = threads;
        bake.run(scene);
        return everything(bake);
    };
    EXPECT_LT(difference(lightWith(1), lightWith(2)), 1e-5);
}

TEST(Multipath, RefusesDirectionsThatAreNotIndependent) {
    Bake bake;
    bake.settings.solver = "MULTIPATH";
    try {
        bake.run(litRoom());
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code, RB_ERROR_INVALID_ARGUMENT);
        const std::string message = error.what();
        EXPECT_NE(message.find("LOW_DISCREPANCY"), std::string::npos) << message;
        EXPECT_NE(message.find("choose directions RANDOM"), std::string::npos) << message;
    }
}

}  // namespace
}  // namespace raybundle
