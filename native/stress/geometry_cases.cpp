// SPDX-License-Identifier: GPL-3.0-or-later
//
// Badly made meshes. All are in a white furnace: the world has radiance 1 / pi, and both sides of
// every surface emit what they do not reflect, so that the irradiance is 1 W/m^2 on every surface,
// whatever its shape.
#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "cases.h"
#include "test_scenes.h"

namespace raybundle::stress {
namespace {

using namespace test;

Material white() { return grey("white", 0.5f, 0.5f, 0.5f); }

Case furnace(const std::string& name) {
    Case made;
    made.group = "geometry";
    made.name = name;
    made.scene.worldRadiance = glm::vec3(float(1 / kPi));
    made.settings.patchSize = 0.1f;
    made.light = 1;
    return made;
}

Case furnaceOf(const std::string& name, std::vector<Mesh> meshes) {
    Case made = furnace(name);
    for (Mesh& mesh : meshes) place(made.scene, std::move(mesh), white());
    return made;
}

Mesh unitBox(const glm::vec3& low = glm::vec3(0)) {
    return box("box", low, low + glm::vec3(1), false);
}

Mesh turned(Mesh mesh) {
    for (size_t f = 0; f < mesh.faceCount(); ++f)
        std::reverse(mesh.cornerVertices.begin() + mesh.faceOffsets[f],
                     mesh.cornerVertices.begin() + mesh.faceOffsets[f + 1]);
    return mesh;
}

// Returns one mesh with the faces of both.
Mesh joined(Mesh a, const Mesh& b) {
    const auto firstVertex = int32_t(a.vertices.size()), firstCorner = a.faceOffsets.back();
    a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
    for (const int32_t v : b.cornerVertices) a.cornerVertices.push_back(firstVertex + v);
    for (size_t f = 1; f < b.faceOffsets.size(); ++f)
        a.faceOffsets.push_back(firstCorner + b.faceOffsets[f]);
    return a;
}

Mesh floorOf(float size) {
    return rectangle("floor", {-size / 2, -size / 2, -0.3f}, {size, 0, 0}, {0, size, 0});
}

// Returns faces of 1 m by 1 micrometre, side by side.
Mesh slivers(int count) {
    return grid("slivers", {0, 0, 0}, {1, 0, 0}, {0, 1e-6f * float(count), 0}, 1, count);
}

// Returns triangles of `size` metres at random places in a ball of radius 1 m.
Mesh dust(int count, float size) {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<float> uniform(-1, 1);
    auto point = [&] { return glm::vec3(uniform(random), uniform(random), uniform(random)); };
    std::vector<glm::vec3> vertices;
    std::vector<std::vector<int32_t>> faces;
    while (int(faces.size()) < count) {
        const glm::vec3 centre = point();
        if (glm::length(centre) > 1) continue;
        const int32_t first = int32_t(vertices.size());
        for (int k = 0; k < 3; ++k) vertices.push_back(centre + size * point());
        faces.push_back({first, first + 1, first + 2});
    }
    return polygons("dust", std::move(vertices), faces);
}

// Returns a box of 2 x 0.2 x 0.2 m.
Mesh bar() { return box("bar", {-1, -0.1f, -0.1f}, {1, 0.1f, 0.1f}, false); }

// Returns three bars, each of which lies on the next. No order from back to front exists for them.
Case interlockedBars() {
    Case made = furnace("three interlocked bars");
    for (int k = 0; k < 3; ++k) {
        glm::dmat4 m = glm::rotate(glm::dmat4(1), 2 * kPi * k / 3, glm::dvec3(0, 0, 1));
        m = glm::translate(m, glm::dvec3(0, 0.35, 0));
        m = glm::rotate(m, 0.25, glm::dvec3(0, 1, 0));
        place(made.scene, bar(), white(), m);
    }
    return made;
}

Case manyObjects(int count) {
    Case made = furnace(std::to_string(count) + " objects");
    const int32_t material = made.scene.addMaterial(white());
    Mesh mesh = box("box", glm::vec3(0), glm::vec3(0.05f), false);
    mesh.faceMaterials.assign(mesh.faceCount(), material);
    const int32_t id = made.scene.addMesh(mesh);
    const int edge = int(std::ceil(std::cbrt(double(count))));
    for (int k = 0; k < count; ++k) {
        const glm::dvec3 at(k % edge, k / edge % edge, k / edge / edge);
        made.scene.addInstance({"box " + std::to_string(k), id,
                                glm::translate(glm::dmat4(1), 0.1 * at), RB_ROLE_BAKE,
                                RB_SIDE_FRONT});
    }
    return made;
}

Case transformed(const std::string& name, const glm::dmat4& transform) {
    Case made = furnace(name);
    place(made.scene, unitBox(), white(), transform);
    place(made.scene, floorOf(3), white());
    return made;
}

Mesh aligned() {
    std::vector<glm::vec3> vertices;
    std::vector<std::vector<int32_t>> faces;
    const Mesh one = box("", glm::vec3(0), glm::vec3(0.25f), false);
    for (int k = 0; k < 27; ++k) {
        const int32_t first = int32_t(vertices.size());
        for (const glm::vec3& v : one.vertices)
            vertices.push_back(v + 0.5f * glm::vec3(k % 3, k / 3 % 3, k / 9));
        for (size_t f = 0; f < 6; ++f) {
            std::vector<int32_t> face;
            for (size_t c = 4 * f; c < 4 * f + 4; ++c)
                face.push_back(first + one.cornerVertices[c]);
            faces.push_back(face);
        }
    }
    return polygons("aligned boxes", std::move(vertices), faces);
}

// Returns a star of ten corners, concave at every second one.
Mesh star() {
    std::vector<glm::vec3> vertices;
    std::vector<int32_t> face;
    for (int k = 0; k < 10; ++k) {
        const double angle = kPi * k / 5, radius = k % 2 ? 0.3 : 1;
        vertices.push_back({float(radius * std::cos(angle)), float(radius * std::sin(angle)), 0});
        face.push_back(k);
    }
    return polygons("star", std::move(vertices), {face});
}

// Adds cases with mirrored, flattened and sheared instances.
void addTransformed(std::vector<Case>& cases) {
    cases.push_back(transformed("mirrored", glm::scale(glm::dmat4(1), glm::dvec3(-1, 1, 1))));
    cases.push_back(
        transformed("flattened to a plane", glm::scale(glm::dmat4(1), glm::dvec3(1, 1, 0))));
    cases.push_back(transformed("shrunk to a point", glm::scale(glm::dmat4(1), glm::dvec3(0))));
    cases.back().says = "area";
    const auto sheared = [](const std::string& name, double factor) {
        return transformed(name,
                           glm::dmat4({1, 0, 0, 0}, {factor, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}));
    };
    cases.push_back(sheared("sheared tenfold", 10));
    // The box is a kilometre long and a millimetre wide, so that few lines meet it. The answer is
    // exact with few lines. The number of lines that the noise would require takes minutes.
    cases.push_back(sheared("sheared a thousandfold, 64 bundles", 1000));
    cases.back().settings.maxBundles = 64;
}

}  // namespace

std::vector<Case> geometryCases(bool isQuick) {
    std::vector<Case> cases;
    cases.push_back(furnaceOf("slivers of 1 m by 1e-6 m",
                              {slivers(isQuick ? 50 : 1000), unitBox({0, 0, 0.2f})}));
    const int triangles = isQuick ? 2000 : 10000;
    cases.push_back(furnaceOf(printed("%g triangles below a pixel", triangles),
                              {dust(triangles, 0.002f), floorOf(3)}));
    if (!isQuick)
        cases.push_back(
            furnaceOf("a million triangles below a pixel", {dust(1000000, 0.0002f), floorOf(3)}));
    cases.push_back(furnaceOf("each face twice", {unitBox(), unitBox()}));
    cases.push_back(furnaceOf("each face twice, once flipped", {unitBox(), turned(unitBox())}));
    cases.push_back(
        furnaceOf("a shell with light on both sides", {joined(unitBox(), turned(unitBox()))}));
    cases.push_back(
        furnaceOf("each face twice, 1e-7 m apart", {unitBox(), unitBox(glm::vec3(1e-7f))}));
    cases.push_back(furnaceOf("boxes that intersect",
                              {unitBox(), unitBox(glm::vec3(0.5f)), unitBox({0.3f, -0.4f, 0.2f})}));
    cases.push_back(furnaceOf("boxes with touching faces",
                              {unitBox(), unitBox({1, 0, 0}), unitBox({0.5f, 1, 0})}));
    cases.push_back(interlockedBars());
    cases.push_back(furnaceOf("three faces at an edge",
                              {polygons("fan",
                                        {{0, 0, 0},
                                         {0, 0, 1},
                                         {1, 0, 0},
                                         {1, 0, 1},
                                         {-1, 1, 0},
                                         {-1, 1, 1},
                                         {-1, -1, 0},
                                         {-1, -1, 1}},
                                        {{0, 2, 3, 1}, {0, 4, 5, 1}, {0, 6, 7, 1}})}));
    cases.push_back(furnaceOf(
        "a box without a lid",
        {polygons("open",
                  {{0, 0, 0},
                   {1, 0, 0},
                   {1, 1, 0},
                   {0, 1, 0},
                   {0, 0, 1},
                   {1, 0, 1},
                   {1, 1, 1},
                   {0, 1, 1}},
                  {{0, 1, 2, 3}, {0, 4, 5, 1}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}})}));
    cases.push_back(furnaceOf("all normals flipped", {turned(unitBox()), floorOf(3)}));
    cases.push_back(furnaceOf(
        "faces without area, and corners on a line",
        {polygons("degenerate", {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 0}},
                  {{0, 1, 2}, {0, 5, 0}, {0, 1, 2, 3, 4}, {3, 3, 3}})}));
    cases.back().says = "area";
    cases.push_back(furnaceOf("a concave face", {star()}));
    cases.push_back(furnaceOf(
        "a face that crosses itself",
        {polygons("bow tie", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2, 3}}),
         floorOf(3)}));
    cases.push_back(furnaceOf(
        "a face that is not planar",
        {polygons("saddle", {{0, 0, 0}, {1, 0, 0.5f}, {1, 1, 0}, {0, 1, 0.5f}}, {{0, 1, 2, 3}})}));
    cases.push_back(furnaceOf("all faces along the axes", {aligned(), floorOf(4)}));
    cases.push_back(furnaceOf(
        "one triangle", {polygons("triangle", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}})}));
    cases.push_back(cases.back());
    cases.back().name = "one patch";
    cases.back().settings.patchSize = 100;
    cases.push_back(manyObjects(isQuick ? 1000 : 10000));
    addTransformed(cases);
    return cases;
}

}  // namespace raybundle::stress
