// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bakes a scene with the default settings and prints the light at its corners, to compare two
// builds of the library: a line with the red, green and blue radiance of each corner with a result,
// in W/(m^2 sr), in the order of the instances. Usage: see kUsage.
#include <cstdio>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "command.h"
#include "job/error.h"
#include "scene_file.h"

namespace raybundle::bench {
namespace {

constexpr char kUsage[] =
    R"(usage: corner_light SCENE.json

  SCENE.json          of blend_tests/export_scene.py
)";

int run(const std::vector<std::string>& arguments) {
    if (arguments.size() != 1) throw invalidArgument("corner_light takes one scene");
    const Scene scene = readScene(arguments[0]);
    Bake bake;
    bake.run(scene);
    for (size_t i = 0; i < scene.instances.size(); ++i) {
        if (scene.instances[i].role != RB_ROLE_BAKE) continue;
        for (const glm::vec3& light : bake.instanceLight(int32_t(i)).perCorner(RB_OUTPUT_COMBINED))
            std::printf("%.9g %.9g %.9g\n", light.r, light.g, light.b);
    }
    return 0;
}

}  // namespace
}  // namespace raybundle::bench

int main(int count, char** values) {
    return raybundle::bench::runCommand("corner_light", raybundle::bench::kUsage, count, values,
                                        raybundle::bench::run);
}
