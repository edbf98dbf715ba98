// SPDX-License-Identifier: GPL-3.0-or-later
//
// MULTIPATH against exact solutions and against LINE_REUSE.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "job/error.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

struct MultipathBake : Bake {
    MultipathBake(const Scene& scene, int bundleCount, int seed, float patchSize,
                  Solver solver = Solver::MULTIPATH,
                  DirectionKind directions = DirectionKind::RANDOM) {
        settings.solver = solver;
        settings.directions = directions;
        settings.patchSize = patchSize;
        settings.contacts = 0;  // to have the same patches for all solvers
        settings.minBundles = settings.maxBundles = bundleCount;
        settings.targetError = 1e-5f;
        settings.seed = seed;
        run(scene);
    }
    double statedError() const { return reportOf(*this)["estimated_error"]; }
};

// Returns the relative RMS difference of the irradiance on all fronts, weighted by area.
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

TEST(Multipath, ConvergesToTheSolutionOfLineReuseWithinTheStatedError) {
    const Scene scene = litRoom(0.6f);
    const MultipathBake reference(scene, 8192, 999, 0.3f, Solver::LINE_REUSE,
                                  DirectionKind::LOW_DISCREPANCY);
    for (int bundles : {64, 256, 1024}) {
        const MultipathBake bake(scene, bundles, 1, 0.3f);
        // The stated error comes from one pair of halves, whose patches share their directions. It
        // scatters by a factor of 2 in both directions.
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
        if (h.x == 0) continue;  // fully covered: the bottoms of the boxes
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
    const MultipathBake reference(scene, 8192, 999, 0.3f, Solver::LINE_REUSE,
                                  DirectionKind::LOW_DISCREPANCY);
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
    bake.settings.solver = Solver::MULTIPATH;
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

TEST(Multipath, ThePseudoCodeOfTheThesisRefusesWeights) {
    Bake bake;
    bake.settings.solver = Solver::MULTIPATH;
    bake.settings.directions = DirectionKind::ADAPTIVE;
    bake.settings.thesisLiteral = 1;
    try {
        bake.run(litRoom());
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code, RB_ERROR_INVALID_ARGUMENT);
        EXPECT_NE(std::string(error.what()).find("choose directions RANDOM"), std::string::npos)
            << error.what();
    }
}

}  // namespace
}  // namespace raybundle
