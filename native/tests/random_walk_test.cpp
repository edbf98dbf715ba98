// SPDX-License-Identifier: GPL-3.0-or-later
//
// Random walks against closed forms of their mean and of their variance.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bake/bake.h"
#include "test_bakes.h"
#include "test_scenes.h"
#include "test_transports.h"

namespace raybundle {
namespace {

using namespace test;

void setWalks(Bake& bake, int bundleCount) {
    setQuick(bake, bundleCount);
    bake.settings.solver = Solver::RANDOM_WALK;
    bake.settings.directions = DirectionKind::RANDOM;
}

// A cube with one patch per face, one of which emits. The walks gather their results.
struct Cube : TransportScene {
    explicit Cube(float pixelSize) : TransportScene(closedCube(0.5f), 10, pixelSize) {
        shot.emission[0] = glm::vec3(1);
    }
};

TEST(RandomWalk, TheMeanIsExactOnACube) {
    Cube cube(0.1f);  // 236 walks per bundle
    for (const auto& estimator : kEstimators) {
        cube.settings.estimator = estimator.value;
        CubeExitance exitance;
        for (int seed = 0; seed < 200; ++seed) {
            const auto walk = cube.make(Solver::RANDOM_WALK, seed);
            walk->advance(2, Progress());
            exitance.add(cube.patches, cube.shot, walk->irradiance(Half::BOTH, 0));
            EXPECT_EQ(walk->bias(), 0);
        }
        exitance.expectExact(estimator.name);
    }
}

TEST(RandomWalk, TheMeanIsExactOnABakedCube) {
    Bake bake;
    setWalks(bake, 8);
    bake.settings.linesPerBundle = 200;
    expectExactOnBakedCube(bake.settings, 200);
}

TEST(RandomWalk, TheVariancesAreThoseOfTheory) {
    // Sbert's formulas for the variance of the reflected radiosity b of a patch of area A with
    // reflectance rho, after N walks from power Phi; zeta = [(I - RF)^-1]_ii - 1. The number of
    // survivals at a patch is geometric like that of visits, but rho times as large.
    //   absorption  [rho / (1 - rho) Phi / A b - b^2] / N
    //   collision   [rho (1 + 2 zeta) Phi / A b - b^2] / N
    //   survival    [    (1 + 2 zeta) Phi / A b - b^2] / N
    const double rho = 0.5, zeta = kCubeExitance[0] - 1;
    Cube cube(0.15f);
    const double walks =
        std::round(kPi * double(cube.patches.radius) * double(cube.patches.radius) / (0.15 * 0.15));
    constexpr int kRuns = 4096;
    for (const auto& row : kEstimators) {
        cube.settings.estimator = row.value;
        Statistics faces[6];
        for (int seed = 0; seed < kRuns / 2; ++seed) {
            const auto walk = cube.make(Solver::RANDOM_WALK, seed);
            walk->advance(2, Progress());
            for (Half half : {Half::FIRST, Half::SECOND}) {
                const Irradiance h = walk->irradiance(half, 0);
                for (uint32_t p = 0; p < 6; ++p)
                    faces[p].add(rho * double(h.direct[2 * p].x + h.indirect[2 * p].x));
            }
        }
        double found[3] = {0, 0, 0};
        for (uint32_t p = 0; p < 6; ++p) found[cubeFace(cube.patches, p)] += faces[p].variance();
        found[2] /= 4;
        for (int k = 0; k < 3; ++k) {
            const double b = kCubeExitance[k] - (k == 0 ? 1 : 0);
            const double factor = row.value == Estimator::COLLISION  ? rho * (1 + 2 * zeta)
                                  : row.value == Estimator::SURVIVAL ? 1 + 2 * zeta
                                                                     : rho / (1 - rho);
            const double exact = (factor * b - b * b) / walks;
            std::printf("[ figures  ] %-10s face %d: variance %.4g, theory %.4g, ratio %.3f\n",
                        row.name, k, found[k], exact, found[k] / exact);
            // The variance of 4096 runs has a standard error of sqrt(2 / 4095) = 2.2 %. The
            // tolerance of 10 % is 4.5 standard errors, which fails by chance once in 10^5
            // comparisons.
            EXPECT_NEAR(found[k] / exact, 1, 0.1) << row.name << ", face " << k;
        }
    }
}

TEST(RandomWalk, ColoursAreUnbiased) {
    // The reflectance is 0 in red, 0.5 in green and 0.8 in blue everywhere. The emission is the
    // same for all estimators.
    Cube cube(0.1f);
    for (glm::vec3& rho : cube.patches.reflectance) rho = {0, 0.5f, 0.8f};
    cube.shot.emission[0] = {1, 2, 0.5f};
    for (const auto& row : kEstimators) {
        cube.settings.estimator = row.value;
        const auto walk = cube.make(Solver::RANDOM_WALK, 1);
        walk->advance(1000, Progress());
        const Irradiance h = walk->irradiance(Half::BOTH, 0);
        // The mean irradiance of all faces is E / (6 (1 - rho)), of which the direct light is E /
        // 6.
        glm::dvec3 direct(0.0), all(0.0);
        for (uint32_t i = 0; i < 12; i += 2) {
            direct += glm::dvec3(h.direct[i]) / 6.0;
            all += glm::dvec3(h.direct[i] + h.indirect[i]) / 6.0;
        }
        // 236 000 walks have a standard error of 0.2 to 0.9 % (the worst are SURVIVAL in blue and
        // the direct light by ABSORPTION).
        for (int c = 0; c < 3; ++c) {
            const double e = double(cube.shot.emission[0][c]) / 6;
            EXPECT_NEAR(direct[c], e, 0.02 * e) << row.name << ", channel " << c;
            const double rho = double(cube.patches.reflectance[0][c]);
            EXPECT_NEAR(all[c], e / (1 - rho), 0.02 * e / (1 - rho))
                << row.name << ", channel " << c;
        }
    }
}

TEST(RandomWalk, BlackSidesGetTheirLightToo) {
    for (const auto& row : kEstimators) {
        TransportScene cube(closedCube(0, 1), 10, 0.05f);
        cube.settings.estimator = row.value;
        const auto walk = cube.make(Solver::RANDOM_WALK, 1);
        walk->advance(100, Progress());
        const Irradiance h = walk->irradiance(Half::BOTH, 0);
        // 94 000 walks, 16 000 of them at each face: 0.8 %.
        for (uint32_t i = 0; i < 12; i += 2) {
            EXPECT_NEAR(h.direct[i].x, 1, 0.04) << row.name;
            EXPECT_EQ(h.indirect[i], glm::vec3(0));
        }
    }
}

TEST(RandomWalk, AConvexObjectGetsAllTheWorldsLight) {
    Scene scene;
    place(scene, icosphere("ball", 1, 0, false), grey("", 0.5f));
    TransportScene ball(scene, 10, 0.05f);
    ball.world = {1, 2, 0.5f};
    const auto walk = ball.make(Solver::RANDOM_WALK, 1);
    walk->advance(200, Progress());
    const Irradiance h = walk->irradiance(Half::BOTH, 0);
    const std::vector<float> open = walk->openShare();
    for (uint32_t i = 0; i < ball.patches.sideCount(); i += 2) {
        // 250 000 walks, 60 % of which hit one of 20 faces: 1.2 % each. The tolerance is four times
        // that.
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(h.direct[i][c] / (float(kPi) * ball.world[c]), 1, 0.05);
        EXPECT_EQ(h.indirect[i], glm::vec3(0));
        EXPECT_EQ(open[i], 1);
        EXPECT_EQ(h.direct[i + 1], glm::vec3(0)) << "nothing comes in";
    }
}

TEST(RandomWalk, ABakedFurnaceHasTheStatedError) {
    double stated = 0, found = 0;
    for (float gap : {0.1f, 0.0f}) {
        const Scene scene = roomWithBoxes(0.5f, 0.5f, gap);
        Bake bake;
        setWalks(bake, 512);
        bake.run(scene);
        const Patches& patches = bake.patches();
        Irradiance exact = bake.patchIrradiance();
        for (size_t i = 0; i < exact.direct.size(); ++i) {
            const bool isReached = exact.direct[i] != glm::vec3(0);
            // No light reaches the bottoms of the boxes, which stand on the floor.
            exact.direct[i] = glm::vec3(isReached ? 1 : 0);
            exact.indirect[i] = glm::vec3(0);
        }
        const double error = frontNoise(patches, bake.patchIrradiance(), exact);
        stated += std::pow(reportOf(bake)["estimated_error"].get<double>(), 2);
        found += error * error;
        EXPECT_LT(error, 0.05);
        const Json energy = reportOf(bake)["energy"];
        EXPECT_LT(energy["balance_error"].get<double>(), 0.01) << energy;
        EXPECT_EQ(energy["escaped"].get<double>(), 0) << "the room is closed";
    }
    // Many patches have independent noise, so that the stated error is right within a few per cent.
    // On partly covered patches the error of the covered share is added.
    EXPECT_NEAR(std::sqrt(found / stated), 1, 0.2);
}

TEST(RandomWalk, AgreesWithLineReuse) {
    Bake reference, bake;
    setQuick(reference, 4096);
    reference.settings.contacts = 0;  // to have the same patches for both solvers
    reference.run(litRoom());
    setWalks(bake, 256);
    for (const auto& row : kEstimators) {
        bake.settings.estimator = row.value;
        bake.run(litRoom());
        const double stated = reportOf(bake)["estimated_error"];
        const double found =
            frontNoise(bake.patches(), bake.patchIrradiance(), reference.patchIrradiance());
        // The reference has 0.2 % of noise. Both have the noise of the gathered light in common.
        EXPECT_LT(found, 1.3 * stated) << row.name;
        EXPECT_GT(found, 0.7 * stated) << row.name;
        // The error common to all patches is smaller than the noise by the root of their number
        // (1000).
        EXPECT_NEAR(indirectPower(bake) / indirectPower(reference), 1, 0.01) << row.name;
    }
}

TEST(RandomWalk, EnergyIsBalancedUnderTheSky) {
    Scene scene;
    place(scene, rectangle("ground", {-3, -3, 0}, {6, 0, 0}, {0, 6, 0}), grey("", 0.5f));
    place(scene, box("house", {-0.5f, -0.5f, 0.01f}, {0.5f, 0.5f, 1}, false), grey("", 0.8f));
    place(scene, box("black", {1.5f, 1.5f, 0.01f}, {2, 2, 1}, false), grey("", 0));
    scene.worldRadiance = {0.5f, 0.7f, 1};
    Bake bake;
    setWalks(bake, 256);
    bake.run(scene);
    const Json energy = reportOf(bake)["energy"];
    EXPECT_GT(energy["escaped"].get<double>(), 0);
    // A million walks. The open share of each patch has noise too.
    EXPECT_LT(energy["balance_error"].get<double>(), 0.01) << energy;
}

TEST(RandomWalk, TheNumberOfThreadsDoesNotMatter) {
    expectSameForThreads([](Bake& bake) { setWalks(bake, 8); });
}

TEST(RandomWalk, SeedsAreIndependent) {
    Cube cube(0.1f);
    const auto one = cube.make(Solver::RANDOM_WALK, 1);
    one->advance(2, Progress());
    const Irradiance a = one->irradiance(Half::FIRST, 0), b = one->irradiance(Half::SECOND, 0);
    EXPECT_NE(a.direct[2], b.direct[2]);
    one->advance(2, Progress());
    const Irradiance c = one->irradiance(Half::FIRST, 0);
    EXPECT_NE(2.0f * a.direct[2], 2.0f * c.direct[2]) << "the second call brings new walks";
    EXPECT_EQ(one->bundleCount(), 4u);
}

}  // namespace
}  // namespace raybundle
