// SPDX-License-Identifier: GPL-3.0-or-later
//
// Measures how much time separate windows for rooms, and culling to these windows, could save in a
// scene of many rooms. Usage: windows [--rooms N] [--bundles N] [SCENE.json ...]
//
// Source of the question: thesis section 7.3.2 (a hierarchy of subscenes bounded by boxes, 4 times
// faster for single global lines). Everything runs on one thread, with the default patches and
// pixels. Printed per scene:
//   pixels        of a bundle's window, and the share that no fragment meets
//   fragments     on each of the other pixels
//   empty pixels  share of the projection time that is spent on pixels without fragments
//   vertices      share that is spent on rotating all vertices to the bundle
//   missed        share that is spent on parents that meet no pixel centre, and the share of these
//                 parents
// For a building of N x N closed rooms (N = 6 by default) an upper bound of the gain is printed
// too: the time to project the building whole, divided by the time to project each room with its
// own window. The density of lines is equal in both.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <limits>
#include <string>
#include <vector>

#include "bundles/directions.h"
#include "bundles/fragment_lists.h"
#include "bundles/rasteriser.h"
#include "patches/patches.h"
#include "scene_file.h"

namespace raybundle::bench {
namespace {

constexpr float kPixelsPerPatch = 2;  // as in bake/trace.cpp
constexpr int kRepeats = 7;           // the least time counts
constexpr glm::vec3 kRoom{5, 4, 2.8f};
constexpr float kWall = 0.2f;  // thickness between two rooms, m

// Returns the least time of each kind of work, s. The kinds are run in turns.
std::vector<double> seconds(const std::vector<std::function<void()>>& kinds) {
    using Clock = std::chrono::steady_clock;
    std::vector<double> least(kinds.size(), std::numeric_limits<double>::max());
    for (int repeat = 0; repeat < kRepeats; ++repeat)
        for (size_t k = 0; k < kinds.size(); ++k) {
            const auto start = Clock::now();
            kinds[k]();
            least[k] =
                std::min(least[k], std::chrono::duration<double>(Clock::now() - start).count());
        }
    return least;
}

double seconds(const std::function<void()>& work) { return seconds(std::vector{work})[0]; }

float pixelSize(const Patches& patches) {
    const double mean = patches.totalArea / double(patches.count());
    return float(std::sqrt(std::min(double(patches.size) * patches.size, mean) / kPixelsPerPatch));
}

// ------------------------------------------------------------------------------------------------
// A building
// ------------------------------------------------------------------------------------------------

void addBox(Scene& scene, const glm::vec3& low, const glm::vec3& high, bool inward) {
    static constexpr int kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    Mesh mesh;
    mesh.name = "box";
    for (int v = 0; v < 8; ++v)
        mesh.vertices.push_back(
            {v & 1 ? high.x : low.x, v & 2 ? high.y : low.y, v & 4 ? high.z : low.z});
    mesh.faceOffsets.push_back(0);
    for (const auto& face : kFaces) {
        for (int k = 0; k < 4; ++k) mesh.cornerVertices.push_back(face[inward ? 3 - k : k]);
        mesh.faceOffsets.push_back(int32_t(mesh.cornerVertices.size()));
    }
    Instance instance;
    instance.name = "box";
    instance.mesh = scene.addMesh(std::move(mesh));
    scene.addInstance(std::move(instance));
}

// Adds a closed room with a table of five boxes, a cupboard and a shelf with eight books.
void addRoom(Scene& scene, int column, int row) {
    const glm::vec3 at(float(column) * (kRoom.x + kWall), float(row) * (kRoom.y + kWall), 0);
    addBox(scene, at, at + kRoom, true);
    auto add = [&](const glm::vec3& low, const glm::vec3& size) {
        addBox(scene, at + low, at + low + size, false);
    };
    add({1.5f, 1.4f, 0.70f}, {1.6f, 0.8f, 0.04f});
    for (int leg = 0; leg < 4; ++leg)
        add({1.55f + 1.45f * float(leg % 2), 1.45f + 0.65f * float(leg / 2), 0.01f},
            {0.05f, 0.05f, 0.68f});
    add({0.1f, 3.2f, 0.01f}, {1.0f, 0.6f, 2.0f});
    add({2.5f, 3.6f, 1.2f}, {1.8f, 0.3f, 0.03f});
    for (int book = 0; book < 8; ++book)
        add({2.55f + 0.2f * float(book), 3.65f, 1.24f}, {0.04f, 0.2f, 0.28f});
}

// ------------------------------------------------------------------------------------------------
// Measurements
// ------------------------------------------------------------------------------------------------

// One projector per window. All have the same pixel size.
class Windows {
  public:
    Windows(const std::vector<Patches>& parts, float pixel) {
        for (const Patches& patches : parts) projectors.emplace_back(patches, pixel);
    }

    void project(const std::vector<Bundle>& bundles) {
        for (const Bundle& bundle : bundles)
            for (FragmentLists& projector : projectors) {
                lines.exchanges.clear();
                lines.sky.clear();
                lines.touching.clear();
                projector.project(bundle, lines);
            }
    }

  private:
    std::vector<FragmentLists> projectors;
    BundleLines lines;
};

// Returns the time of the work that FragmentLists does per pixel whether or not a fragment meets
// it, s.
double secondsToPassPixels(size_t pixels) {
    std::vector<uint32_t> begin;
    volatile size_t lists = 0;
    return seconds([&] {
        begin.assign(pixels + 1, 0);
        for (size_t p = 1; p < begin.size(); ++p) begin[p] += begin[p - 1];
        for (int pass = 0; pass < 2; ++pass) {
            size_t found = 0;
            for (size_t p = 0; p + 1 < begin.size(); ++p) found += begin[p] != begin[p + 1];
            lists = lists + found;
        }
    });
}

void measure(const std::string& name, const Patches& patches, uint32_t bundleCount) {
    const float pixel = pixelSize(patches);
    const std::vector<Bundle> bundles =
        Directions(DirectionKind::LOW_DISCREPANCY, 1).next(bundleCount);
    const std::vector<Patches> parts{patches};
    Windows window(parts, pixel);
    const double whole = seconds([&] { window.project(bundles); });

    Rasteriser rasteriser(patches, pixel, SmallPatches::CENTRE_SAMPLING);
    double pixels = 0, met = 0, fragments = 0, missed = 0;
    double passing = 0, turning = 0, missing = 0;
    for (const Bundle& bundle : bundles) {
        rasteriser.begin(bundle);
        std::vector<bool> isMet(rasteriser.pixelCount(), false);
        std::vector<bool> hits(patches.parents.size(), false);
        rasteriser.forEachFragment([&](uint32_t p, double, uint32_t side) {
            isMet[p] = true;
            hits[patches.parentOf[side / 2]] = true;
            ++fragments;
        });
        const double metHere = double(std::count(isMet.begin(), isMet.end(), true));
        pixels += double(rasteriser.pixelCount());
        met += metHere;
        passing += secondsToPassPixels(rasteriser.pixelCount()) *
                   (1 - metHere / double(rasteriser.pixelCount()));
        turning += seconds([&] { rasteriser.begin(bundle); });

        Patches rest = patches;
        rest.parents.clear();
        for (size_t k = 0; k < hits.size(); ++k)
            if (!hits[k]) rest.parents.push_back(patches.parents[k]);
        missed += double(rest.parents.size());
        Rasteriser restRasteriser(rest, pixel, SmallPatches::CENTRE_SAMPLING);
        restRasteriser.begin(bundle);
        volatile uint32_t sink = 0;
        missing += seconds([&] {
            restRasteriser.forEachFragment([&](uint32_t p, double, uint32_t) { sink = p; });
        });
    }
    const double n = double(bundleCount);
    std::printf(
        "%-16s %6zu parents %7zu patches | %7.0f pixels, %4.1f %% empty, %.2f fragments on the "
        "others | %.3f ms a bundle: empty pixels %.1f %%, vertices %.1f %%, missed parents %.1f %% "
        "(%.0f %% of them)\n",
        name.c_str(), patches.parents.size(), patches.count(), pixels / n, 100 * (1 - met / pixels),
        fragments / met, 1000 * whole / n, 100 * passing / whole, 100 * turning / whole,
        100 * missing / whole, 100 * missed / n / double(patches.parents.size()));
}

void measureBuilding(int rooms, uint32_t bundleCount) {
    Scene building;
    for (int row = 0; row < rooms; ++row)
        for (int column = 0; column < rooms; ++column) addRoom(building, column, row);
    // Both use the patch size that a single room would have.
    Scene single;
    addRoom(single, 0, 0);
    const float patchSize = subdivide(single, 0, 100000).size;
    const Patches whole = subdivide(building, patchSize, 10000000);
    measure(std::to_string(rooms) + " x " + std::to_string(rooms) + " rooms", whole, bundleCount);

    const float pixel = pixelSize(whole);
    const std::vector<Bundle> bundles =
        Directions(DirectionKind::LOW_DISCREPANCY, 1).next(bundleCount);
    std::vector<Patches> parts;
    for (int row = 0; row < rooms; ++row)
        for (int column = 0; column < rooms; ++column) {
            Scene room;
            addRoom(room, column, row);
            parts.push_back(subdivide(room, patchSize, 10000000));
        }
    const std::vector<Patches> wholePart{whole};
    Windows one(wholePart, pixel), many(parts, pixel);
    const std::vector<double> times =
        seconds({[&] { one.project(bundles); }, [&] { many.project(bundles); }});
    std::printf("whole %.3f ms a bundle, room by room %.3f ms: %.2f times faster at best\n",
                1000 * times[0] / bundleCount, 1000 * times[1] / bundleCount, times[0] / times[1]);
}

}  // namespace
}  // namespace raybundle::bench

int main(int count, char** values) {
    using namespace raybundle::bench;
    try {
        int rooms = 6;
        uint32_t bundles = 32;
        for (int k = 1; k < count; ++k) {
            const std::string argument = values[k];
            if (argument == "--rooms" && k + 1 < count) {
                rooms = std::stoi(values[++k]);
            } else if (argument == "--bundles" && k + 1 < count) {
                bundles = uint32_t(std::stoi(values[++k])) & ~1u;
            } else {
                const raybundle::Scene scene = readScene(argument);
                measure(std::filesystem::path(argument).stem().string(),
                        raybundle::subdivide(scene, 0, 100000), bundles);
            }
        }
        measureBuilding(rooms, bundles);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "windows: %s\n", error.what());
        return 1;
    }
}
