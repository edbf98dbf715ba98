// SPDX-License-Identifier: GPL-3.0-or-later
#include "test_transports.h"

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "test_scenes.h"

namespace raybundle::test {

TransportScene::TransportScene(const Scene& scene, float patchSize, float pixelSize)
    : patches(subdivide(scene, patchSize, kMany)),
      visibility(patches),
      exposed(patches.sideCount(), 1.0f),
      projector{patches, visibility, pixelSize},
      counts(patches.sideCount()) {
    shot.irradiance.assign(patches.sideCount(), glm::vec3(0));
    shot.emission = patches.emission;
}

std::unique_ptr<Transport> TransportScene::make(Solver solver, int seed) {
    settings.seed = seed;
    tracer = std::make_unique<BundleTracer>(ProjectorKind::AUTO, projector, DirectionKind::RANDOM,
                                            uint32_t(seed));
    return makeTransport(solver,
                         {{patches, exposed}, visibility, shot, world, settings, *tracer, counts});
}

int cubeFace(const Patches& patches, uint32_t patch) {
    if (patch == 0) return 0;
    return patches.normal(2 * patch) == -patches.normal(0) ? 1 : 2;
}

void CubeExitance::add(const Patches& patches, const FirstShot& shot, const Irradiance& light) {
    double exitance[3] = {0, 0, 0};
    for (uint32_t p = 0; p < 6; ++p)
        exitance[cubeFace(patches, p)] +=
            double(shot.emission[2 * p].x + 0.5f * light.all(2 * p).x);
    exitance[2] /= 4;
    for (size_t k = 0; k < 3; ++k) faces[k].add(exitance[k]);
}

void CubeExitance::expectExact(const std::string& what) const {
    for (size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(faces[k].mean(), kCubeExitance[k], 3 * faces[k].standardError())
            << what << ", face " << k;
        EXPECT_LT(faces[k].standardError(), 0.01 * kCubeExitance[k]) << what << ", face " << k;
    }
}

std::array<double, 3> cubeExitance(const std::array<double, 3>& direct) {
    const double opposite = parallelRectangles(1, 1, 1);
    const double beside = perpendicularRectangles(1, 1, 1), rho = 0.5;
    std::array<double, 3> b{};  // reflected exitance
    for (int bounce = 0; bounce < 100; ++bounce)
        b = {rho * (direct[0] + opposite * b[1] + 4 * beside * b[2]),
             rho * (direct[1] + opposite * b[0] + 4 * beside * b[2]),
             rho * (direct[2] + beside * (b[0] + b[1]) + (2 * beside + opposite) * b[2])};
    return {1 + b[0], b[1], b[2]};
}

void expectExactOnBakedCube(const Settings& settings, int seeds) {
    Scene scene = closedCube(0.5f);
    scene.meshes[0].faceMaterials[0] = scene.addMaterial(grey("lamp", 0.5f, 1));
    Statistics faces[3];
    std::array<double, 3> direct{};
    for (int seed = 0; seed < seeds; ++seed) {
        Bake bake;
        bake.settings = settings;
        bake.settings.patchSize = 10;
        bake.settings.seed = seed;
        bake.run(scene);
        std::array<double, 3> exitance{1, 0, 0};
        for (uint32_t p = 0; p < 6; ++p) {
            const int face = cubeFace(bake.patches(), p);
            const double share = face == 2 ? 0.25 : 1;
            const double straight = double(bake.patchIrradiance().direct[2 * p].x);
            const double all = straight + double(bake.patchIrradiance().indirect[2 * p].x);
            exitance[size_t(face)] += share * 0.5 * all;
            direct[size_t(face)] += share * straight / seeds;
        }
        for (size_t k = 0; k < 3; ++k) faces[k].add(exitance[k]);
    }
    // The gathered light of a patch as large as a wall is up to 1 % off, equally for every seed.
    // This error is not what is tested here.
    const double exact[] = {0, parallelRectangles(1, 1, 1), perpendicularRectangles(1, 1, 1)};
    const std::array<double, 3> expected = cubeExitance(direct);
    for (size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(direct[k], exact[k], 0.01 * exact[k]) << "face " << k;
        EXPECT_NEAR(faces[k].mean(), expected[k], 3 * faces[k].standardError()) << "face " << k;
        EXPECT_NEAR(expected[k], kCubeExitance[k], 0.01 * kCubeExitance[k]) << "face " << k;
    }
}

double frontNoise(const Patches& patches, const Irradiance& a, const Irradiance& b) {
    double squares = 0, signal = 0;
    for (size_t i = 0; i < patches.sideCount(); i += 2) {
        const glm::dvec3 x(a.direct[i] + a.indirect[i]), y(b.direct[i] + b.indirect[i]);
        squares += double(patches.area[i / 2]) * glm::dot(x - y, x - y);
        signal += double(patches.area[i / 2]) * glm::dot(y, y);
    }
    return std::sqrt(squares / signal);
}

}  // namespace raybundle::test
