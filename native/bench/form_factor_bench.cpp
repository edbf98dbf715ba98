// SPDX-License-Identifier: GPL-3.0-or-later
//
// Prints the error of each estimator of a form factor over the number of lines, as lines of JSON.
// The error is the relative RMS difference from the closed form, over several seeds. The two scenes
// are two unit squares that face each other at a distance of 1, and two unit squares with a common
// edge.
//
//   form_factor_bench [SEEDS]
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>

#include "bench/form_factors.h"
#include "scene/scene.h"

namespace {

using namespace raybundle;

void addSquare(Scene& scene, const glm::vec3& a, const glm::vec3& b, const glm::vec3& origin) {
    Mesh mesh;
    mesh.name = "square";
    mesh.vertices = {origin, origin + a, origin + a + b, origin + b};
    mesh.cornerVertices = {0, 1, 2, 3};
    mesh.faceOffsets = {0, 4};
    mesh.faceMaterials = {-1};
    const int32_t id = scene.addMesh(std::move(mesh));
    scene.addInstance({"square", id, glm::dmat4(1.0), RB_ROLE_BAKE, RB_SIDE_FRONT});
}

void measure(const char* name, const Scene& scene, double exact, uint32_t seeds) {
    const Patches patches = subdivide(scene, 10, 1000);
    const Visibility visibility(patches);
    const FormFactor f{patches, visibility, 0, 2};
    for (const FormFactorEstimator& estimator : formFactorEstimators())
        for (uint32_t lines = 1 << 8; lines <= 1 << 14; lines *= 2) {
            const auto start = std::chrono::steady_clock::now();
            double squares = 0;
            for (uint32_t seed = 0; seed < seeds; ++seed) {
                std::seed_seq words{seed, lines};
                std::mt19937_64 random(words);
                const double d = estimator.estimate(f, lines, random) / exact - 1;
                squares += d * d / seeds;
            }
            const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
            nlohmann::json row = {{"scene", name},
                                  {"estimator", estimator.name},
                                  {"lines", lines},
                                  {"relative_rms", std::sqrt(squares)},
                                  {"seconds", time.count() / seeds},
                                  {"seeds", seeds}};
            std::cout << row << "\n";
        }
}

}  // namespace

int main(int argc, char** argv) {
    const int seeds = argc > 1 ? std::atoi(argv[1]) : 100;
    if (argc > 2 || seeds < 1) {
        std::fprintf(stderr, "usage: form_factor_bench [SEEDS]\n");
        return 2;
    }
    // Closed forms: Howell, A Catalog of Radiation Heat Transfer Configuration Factors, C-11, C-14.
    Scene parallel, perpendicular;
    addSquare(parallel, {1, 0, 0}, {0, 1, 0}, {0, 0, 0});
    addSquare(parallel, {0, 1, 0}, {1, 0, 0}, {0, 0, 1});
    measure("parallel", parallel, 0.19982489569838746, uint32_t(seeds));
    addSquare(perpendicular, {1, 0, 0}, {0, 1, 0}, {0, 0, 0});
    addSquare(perpendicular, {0, 1, 0}, {0, 0, 1}, {0, 0, 0});
    measure("perpendicular", perpendicular, 0.20004377607540316, uint32_t(seeds));
}
