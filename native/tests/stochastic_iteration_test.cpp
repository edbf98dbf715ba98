// SPDX-License-Identifier: GPL-3.0-or-later
//
// Stochastic iteration with both operators against closed forms, and cases in which it must be
// refused.
#include "transport/stochastic_iteration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bake/bake.h"
#include "job/error.h"
#include "test_bakes.h"
#include "test_scenes.h"
#include "test_transports.h"

namespace raybundle {
namespace {

using namespace test;

constexpr Solver kSolver = Solver::STOCHASTIC_ITERATION;

void setIteration(Bake& bake, int bundleCount) {
    setQuick(bake, bundleCount);
    bake.settings.solver = kSolver;
    bake.settings.directions = DirectionKind::RANDOM;
}

// Returns the message of the refusal, or "" if the solver is accepted.
std::string refusal(TransportScene& scene) {
    try {
        scene.make(kSolver, 1);
    } catch (const Error& error) {
        EXPECT_EQ(error.code, RB_ERROR_INVALID_ARGUMENT);
        return error.what();
    }
    return "";
}

struct Operator {
    const char* name;
    int linesPerBundle;
    uint32_t bundles;
};
// Enough bundles for the start-up error to be below the error of a mean over 200 seeds.
constexpr Operator kOperators[] = {{"bundles", 0, 64}, {"single rays", 1, 512}};

TEST(StochasticIteration, TheMeanIsExactOnACube) {
    TransportScene cube(closedCube(0.5f), 10, 0.1f);
    cube.shot.emission[0] = glm::vec3(1);
    for (const Operator& op : kOperators) {
        cube.settings.linesPerBundle = op.linesPerBundle;
        CubeExitance exitance;
        for (int seed = 0; seed < 200; ++seed) {
            const auto iteration = cube.make(kSolver, seed);
            iteration->advance(2 * op.bundles, Progress());
            EXPECT_EQ(iteration->bundleCount(), 2 * op.bundles);
            EXPECT_LT(iteration->bias(), 1e-3);
            exitance.add(cube.patches, cube.shot, iteration->irradiance(Half::BOTH, 0));
        }
        exitance.expectExact(op.name);
    }
}

TEST(StochasticIteration, TheMeanIsExactOnABakedCube) {
    for (const Operator& op : kOperators) {
        SCOPED_TRACE(op.name);
        Bake bake;
        setIteration(bake, int(op.bundles));
        bake.settings.linesPerBundle = op.linesPerBundle ? op.linesPerBundle : 200;
        expectExactOnBakedCube(bake.settings, 200);
    }
}

TEST(StochasticIteration, TheClosedFormOfTheCubeIsThatOfTheOracle) {
    const std::array<double, 3> b =
        cubeExitance({0, parallelRectangles(1, 1, 1), perpendicularRectangles(1, 1, 1)});
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(b[k], kCubeExitance[k], 1e-10);
}

TEST(StochasticIteration, TheStartUpIsAsStated) {
    // After one bundle there is only direct light: 1 / 6 of 1 / (6 (1 - rho)).
    TransportScene cube(closedCube(0.5f), 10, 0.1f);
    cube.shot.emission[0] = glm::vec3(1);
    Statistics mean, stated;
    for (int seed = 0; seed < 1000; ++seed) {
        const auto iteration = cube.make(kSolver, seed);
        iteration->advance(2, Progress());
        const Irradiance h = iteration->irradiance(Half::BOTH, 0);
        double sum = 0;
        for (uint32_t i = 0; i < 12; i += 2) sum += double(h.direct[i].x + h.indirect[i].x) / 6;
        mean.add(sum);
        stated.add(iteration->bias());
    }
    const double exact = 1 / (6 * (1 - 0.5));
    EXPECT_NEAR(mean.mean(), exact * (1 - stated.mean()), 4 * mean.standardError());
    EXPECT_NEAR(stated.mean(), 0.5, 1e-6);
}

TEST(StochasticIteration, AFurnaceHasTheStatedError) {
    // The error of a bundle is correlated over many patches. There are few independent values, so
    // eight seeds are used.
    const Scene scene = roomWithBoxes(0.5f, 0.5f);
    double stated = 0, found = 0;
    for (int seed = 0; seed < 8; ++seed) {
        Bake bake;
        setIteration(bake, 512);
        bake.settings.seed = seed;
        bake.run(scene);
        Irradiance exact(bake.patches().sideCount());
        exact.direct.assign(bake.patches().sideCount(), glm::vec3(1));
        const double error = frontNoise(bake.patches(), bake.patchIrradiance(), exact);
        found += error * error;
        stated += std::pow(reportOf(bake)["estimated_error"].get<double>(), 2);
        const Json energy = reportOf(bake)["energy"];
        EXPECT_LT(energy["balance_error"].get<double>(), 0.1) << energy;
    }
    std::printf("[ figures  ] furnace: stated %.4f, found %.4f\n", std::sqrt(stated / 8),
                std::sqrt(found / 8));
    EXPECT_LT(std::sqrt(found / 8), 0.08);
    EXPECT_NEAR(std::sqrt(found / stated), 1, 0.3);
}

TEST(StochasticIteration, CoveredPartsGetNoLight) {
    // Boxes that stand on the floor, so that patches of the floor are partly covered.
    for (int linesPerBundle : {0, 1}) {
        Bake bake;
        setIteration(bake, linesPerBundle ? 2000000 : 1024);
        bake.settings.linesPerBundle = linesPerBundle;
        bake.run(roomWithBoxes(0.5f, 0.5f, 0));
        Irradiance exact = bake.patchIrradiance();
        double dark = 0;  // m^2
        for (size_t i = 0; i < exact.direct.size(); ++i) {
            const bool isReached = exact.direct[i] != glm::vec3(0);
            if (i % 2 == 0 && !isReached) dark += double(bake.patches().area[i / 2]);
            exact.direct[i] = glm::vec3(isReached ? 1 : 0);
            exact.indirect[i] = glm::vec3(0);
        }
        // The floor is cut along the boxes.
        EXPECT_NEAR(dark, 2 * (0.8 * 0.7 + 0.6 * 0.7), 1e-5)
            << "their bottoms, and what they stand on";
        const double stated = reportOf(bake)["estimated_error"];
        const double found = frontNoise(bake.patches(), bake.patchIrradiance(), exact);
        std::printf("[ figures  ] standing boxes, %s: stated %.4f, found %.4f\n",
                    linesPerBundle ? "single rays" : "bundles", stated, found);
        // The covered share of a patch is determined by lines too, within some per cent.
        EXPECT_LT(found, 1.5 * stated);
    }
}

TEST(StochasticIteration, AgreesWithLineReuse) {
    Bake reference;
    setQuick(reference, 4096);
    reference.settings.contacts = 0;  // to have the same patches for both solvers
    reference.run(litRoom());
    for (int linesPerBundle : {0, 1}) {
        Bake bake;
        setIteration(bake, linesPerBundle ? 400000 : 2048);
        bake.settings.linesPerBundle = linesPerBundle;
        bake.run(litRoom());
        const double stated = reportOf(bake)["estimated_error"];
        const double found =
            frontNoise(bake.patches(), bake.patchIrradiance(), reference.patchIrradiance());
        std::printf("[ figures  ] litRoom, %s: stated %.4f, found %.4f\n",
                    linesPerBundle ? "single rays" : "bundles", stated, found);
        EXPECT_LT(found, 0.08);
        // For bundles the half difference of two estimates is itself uncertain by half its size.
        EXPECT_LT(found, 2 * stated);
        EXPECT_NEAR(indirectPower(bake) / indirectPower(reference), 1, 0.03);
    }
}

TEST(StochasticIteration, EnergyIsBalancedUnderTheSky) {
    Scene scene;
    place(scene, rectangle("ground", {-3, -3, 0}, {6, 0, 0}, {0, 6, 0}), grey("", 0.5f));
    place(scene, box("house", {-0.5f, -0.5f, 0.01f}, {0.5f, 0.5f, 1}, false), grey("", 0.7f));
    scene.worldRadiance = {0.5f, 0.7f, 1};
    for (int linesPerBundle : {0, 1}) {
        Bake bake;
        setIteration(bake, linesPerBundle ? 400000 : 2048);
        bake.settings.linesPerBundle = linesPerBundle;
        bake.run(scene);
        const Json energy = reportOf(bake)["energy"];
        EXPECT_GT(energy["escaped"].get<double>(), 0);
        // Reflected light and open shares by 2048 directions have 2 % of noise.
        EXPECT_LT(energy["balance_error"].get<double>(), 0.03) << energy;
    }
}

TEST(StochasticIteration, TheNumberOfThreadsDoesNotMatter) {
    for (int linesPerBundle : {0, 1})
        expectSameForThreads([&](Bake& bake) {
            setIteration(bake, linesPerBundle ? 40000 : 64);
            bake.settings.linesPerBundle = linesPerBundle;
        });
}

TEST(StochasticIterationLimit, LargePatchesOfReflectance08Converge) {
    TransportScene cube(closedCube(0.8f, 0.2f), 10, 0.2f);
    ASSERT_EQ(refusal(cube), "");
    double errors[3] = {0, 0, 0};
    for (int k = 0; k < 3; ++k)
        for (int seed = 0; seed < 40; ++seed) {
            const auto iteration = cube.make(kSolver, seed);
            iteration->advance(64 << 3 * k, Progress());
            const Irradiance h = iteration->irradiance(Half::BOTH, 0);
            double sum = 0;
            for (uint32_t i = 0; i < 12; i += 2) sum += double(h.direct[i].x + h.indirect[i].x) / 6;
            errors[k] += (sum - 1) * (sum - 1) / 40;
        }
    std::printf("[ figures  ] rho 0.8: error %.4f after 64, %.4f after 512, %.4f after 4096\n",
                std::sqrt(errors[0]), std::sqrt(errors[1]), std::sqrt(errors[2]));
    // Eight times the bundles reduce the error by the root of eight, apart from noise. Close to the
    // limit the mean square of 40 seeds is uncertain by half its size.
    EXPECT_LT(std::sqrt(errors[2]), 0.5 * std::sqrt(errors[1]));
}

TEST(StochasticIterationLimit, HighReflectanceIsRefused) {
    TransportScene cube(closedCube(0.95f, 0.05f), 10, 0.02f);
    const std::string message = refusal(cube);
    for (const char* part :
         {"STOCHASTIC_ITERATION", "reflectances", "lines_per_bundle", "patch_size", "LINE_REUSE"})
        EXPECT_NE(message.find(part), std::string::npos) << message;
    cube.settings.linesPerBundle = 1;
    EXPECT_EQ(refusal(cube), "") << "single rays always converge";
}

TEST(StochasticIterationLimit, SubPixelPatchesAreRefused) {
    // A patch of 0.26 pixels.
    TransportScene cube(closedCube(0.7f, 0.3f), 0.1f, 0.1f / std::sqrt(0.26f));
    EXPECT_NE(refusal(cube), "");
    for (glm::vec3& rho : cube.patches.reflectance) rho = glm::vec3(0.3f);
    EXPECT_EQ(refusal(cube), "") << "A / s^2 > 2 rho^2";
}

// An open sheet of many small squares, which see the room but not each other.
Mesh confetti(int count, float edge) {
    std::vector<glm::vec3> vertices;
    std::vector<std::vector<int32_t>> faces;
    for (int k = 0; k < count; ++k) {
        const glm::vec3 at(1 + 0.05f * float(k % 20), 0.3f + 0.03f * float(k / 20), 0.5f);
        const int32_t first = int32_t(vertices.size());
        for (glm::vec2 p : {glm::vec2(0, 0), {1, 0}, {1, 1}, {0, 1}})
            vertices.push_back(at + edge * glm::vec3(p, 0));
        faces.push_back({first, first + 1, first + 2, first + 3});
    }
    return polygons("confetti", vertices, faces);
}

TEST(StochasticIterationLimit, AFewSmallPatchesDoNotSpoilIt) {
    Scene scene = roomWithBoxes(0.7f, 0.3f);
    place(scene, confetti(100, 0.005f), grey("", 0.9f));
    TransportScene room(scene, 0.4f, 0.1f);
    EXPECT_EQ(refusal(room), "");
    // The light on the other patches is as accurate as without the small ones.
    const auto iteration = room.make(kSolver, 1);
    iteration->advance(2048, Progress());
    const Irradiance h = iteration->irradiance(Half::BOTH, 0);
    double sum = 0, area = 0;
    for (uint32_t i = 0; i < room.patches.sideCount(); i += 2) {
        if (room.patches.area[i / 2] < 1e-3f) continue;
        sum += double(room.patches.area[i / 2]) * double(h.direct[i].x + h.indirect[i].x);
        area += double(room.patches.area[i / 2]);
    }
    EXPECT_NEAR(sum / area, 1, 0.1);
}

TEST(StochasticIterationLimit, GrowthIsThatOfTheory) {
    // Large patches that all see each other equally grow by 4/3 rho^2; if half of them are black,
    // by half of it.
    Scene scene;
    place(scene, icosphere("ball", 1, 1, true), grey("", 0.6f, 1));
    TransportScene ball(scene, 10, 0.02f);
    LineCounts counts(ball.patches.sideCount());
    const ProjectorInput projector{ball.patches, ball.visibility, 0.02f};
    BundleTracer tracer(ProjectorKind::AUTO, projector, DirectionKind::RANDOM, 1);
    const TransportInput input{{ball.patches, ball.exposed},
                               ball.visibility,
                               ball.shot,
                               ball.world,
                               ball.settings,
                               tracer,
                               counts};
    const std::vector<TracedBundle> traced = tracer.trace(16);
    EXPECT_NEAR(meanSquareGrowth(input, traced), 4.0 / 3 * 0.36, 0.001);
    for (uint32_t i = 0; i < ball.patches.sideCount(); i += 4)
        ball.patches.reflectance[i] = glm::vec3(0);
    EXPECT_NEAR(meanSquareGrowth(input, traced), 0.5 * 4.0 / 3 * 0.36, 0.03);
}

}  // namespace
}  // namespace raybundle
