// SPDX-License-Identifier: GPL-3.0-or-later
#include "test_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>

#include "bundles/directions.h"
#include "bundles/fragment_lists.h"

namespace raybundle::test {

Mesh polygons(const std::string& name, std::vector<glm::vec3> vertices,
              const std::vector<std::vector<int32_t>>& faces) {
    Mesh mesh;
    mesh.name = name;
    mesh.vertices = std::move(vertices);
    mesh.faceOffsets = {0};
    for (const std::vector<int32_t>& face : faces) {
        mesh.cornerVertices.insert(mesh.cornerVertices.end(), face.begin(), face.end());
        mesh.faceOffsets.push_back(int32_t(mesh.cornerVertices.size()));
    }
    return mesh;
}

Mesh grid(const std::string& name, const glm::vec3& origin, const glm::vec3& a, const glm::vec3& b,
          int na, int nb) {
    std::vector<glm::vec3> vertices;
    for (int j = 0; j <= nb; ++j)
        for (int i = 0; i <= na; ++i)
            vertices.push_back(origin + (float(i) / float(na)) * a + (float(j) / float(nb)) * b);
    std::vector<std::vector<int32_t>> faces;
    for (int j = 0; j < nb; ++j)
        for (int i = 0; i < na; ++i) {
            const int32_t first = j * (na + 1) + i, above = first + na + 1;
            faces.push_back({first, first + 1, above + 1, above});
        }
    return polygons(name, std::move(vertices), faces);
}

Mesh box(const std::string& name, const glm::vec3& low, const glm::vec3& high, bool inward) {
    std::vector<glm::vec3> vertices;
    for (float z : {low.z, high.z})
        for (glm::vec2 p : {glm::vec2(low.x, low.y), glm::vec2(high.x, low.y),
                            glm::vec2(high.x, high.y), glm::vec2(low.x, high.y)})
            vertices.emplace_back(p.x, p.y, z);
    std::vector<std::vector<int32_t>> faces = {{0, 1, 2, 3}, {4, 7, 6, 5}, {0, 4, 5, 1},
                                               {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}};
    if (!inward)
        for (auto& face : faces) std::reverse(face.begin(), face.end());
    return polygons(name, std::move(vertices), faces);
}

Mesh floorWithSlivers(int n, float height) {
    std::vector<glm::vec3> vertices;
    std::vector<std::vector<int32_t>> faces, slivers;
    auto vertex = [&](float x, float y) {
        vertices.push_back({x, y, 0});
        return int32_t(vertices.size()) - 1;
    };
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) vertex(float(i), float(j));
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const int32_t a = j * (n + 1) + i, b = a + 1, d = a + n + 1, c = d + 1;
            if (i % 2 == 0) {
                faces.push_back({a, b, c, d});
                continue;
            }
            const int32_t left = vertex(float(i) + height, float(j) + 0.5f),
                          right = vertex(float(i + 1) - height, float(j) + 0.5f);
            faces.insert(faces.end(), {{a, b, right, left}, {left, right, c, d}});
            slivers.insert(slivers.end(), {{a, left, d}, {b, c, right}});
        }
    faces.insert(faces.end(), slivers.begin(), slivers.end());
    return polygons("floor", vertices, faces);
}

Mesh icosphere(const std::string& name, float radius, int levels, bool inward) {
    const double g = 0.5 * (1 + std::sqrt(5.0));
    std::vector<glm::dvec3> points = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                      {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                      {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    for (glm::dvec3& p : points) p = glm::normalize(p);
    std::vector<std::vector<int32_t>> faces = {
        {0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
        {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
        {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<int32_t, int32_t>, int32_t> middles;
        auto middle = [&](int32_t a, int32_t b) {
            const auto [place, isNew] =
                middles.try_emplace(std::minmax(a, b), int32_t(points.size()));
            if (isNew) points.push_back(glm::normalize(points[size_t(a)] + points[size_t(b)]));
            return place->second;
        };
        std::vector<std::vector<int32_t>> finer;
        for (const auto& f : faces) {
            const int32_t ab = middle(f[0], f[1]), bc = middle(f[1], f[2]), ca = middle(f[2], f[0]);
            finer.insert(finer.end(),
                         {{f[0], ab, ca}, {f[1], bc, ab}, {f[2], ca, bc}, {ab, bc, ca}});
        }
        faces = std::move(finer);
    }
    if (inward)
        for (auto& face : faces) std::reverse(face.begin(), face.end());
    std::vector<glm::vec3> vertices;
    for (const glm::dvec3& p : points) vertices.push_back(glm::vec3(double(radius) * p));
    return polygons(name, std::move(vertices), faces);
}

Material grey(const std::string& name, float reflectance, float emission, float backEmission) {
    Material material;
    material.name = name;
    for (MaterialSide& side : material.sides) side.reflectance.constant = glm::vec3(reflectance);
    material.sides[0].emission.constant = glm::vec3(emission);
    material.sides[1].emission.constant = glm::vec3(backEmission);
    return material;
}

int32_t place(Scene& scene, Mesh mesh, const Material& material, const glm::dmat4& transform,
              rb_role role, rb_side side) {
    mesh.faceMaterials.assign(mesh.faceCount(), scene.addMaterial(material));
    const std::string name = mesh.name;
    const int32_t id = scene.addMesh(std::move(mesh));
    return scene.addInstance({name, id, transform, role, side});
}

Scene closedCube(float reflectance, float emission) {
    Scene scene;
    place(scene, box("cube", glm::vec3(0), glm::vec3(1), true),
          grey("inside", reflectance, emission));
    return scene;
}

Scene roomWithBoxes(float reflectance, float emission, float gap) {
    Scene scene;
    place(scene, box("room", {0, 0, 0}, {4, 3.2f, 2.8f}, true),
          grey("walls", reflectance, emission));
    const Material boxes = grey("boxes", reflectance, emission);
    const Mesh low = box("low box", {-0.4f, -0.35f, 0}, {0.4f, 0.35f, 0.7f}, false);
    place(scene, low, boxes,
          glm::rotate(glm::translate(glm::dmat4(1), glm::dvec3(1.1, 1.3, gap)), 0.4,
                      glm::dvec3(0, 0, 1)));
    const Mesh high = box("high box", {2.6f, 1.6f, gap}, {3.2f, 2.3f, 1.5f}, false);
    place(scene, high, boxes);
    return scene;
}

Light pointLight(const glm::dvec3& position, const glm::dvec3& intensity) {
    Light light;
    light.name = "point";
    light.position = position;
    light.strength = intensity;
    return light;
}

Light areaLight(const glm::dvec3& centre, const glm::dvec3& axisU, const glm::dvec3& axisV,
                const glm::dvec3& radiance, rb_area_shape shape) {
    Light light;
    light.name = "area";
    light.kind = Light::Kind::AREA;
    light.position = centre;
    light.axisU = axisU;
    light.axisV = axisV;
    light.strength = radiance;
    light.areaShape = shape;
    return light;
}

Light sunLight(const glm::dvec3& direction, const glm::dvec3& irradiance, double angle) {
    Light light;
    light.name = "sun";
    light.kind = Light::Kind::SUN;
    light.direction = direction;
    light.strength = irradiance;
    light.angle = angle;
    return light;
}

LineCounts traceLines(const Patches& patches, float pixelSize, uint32_t count, uint32_t seed,
                      DirectionKind directions) {
    FragmentLists projector(patches, pixelSize);
    Directions sequence(directions, seed);
    LineCounts counts(patches.sideCount());
    constexpr uint32_t kBatch = 256;
    for (uint32_t first = 0; first < count; first += kBatch) {
        std::vector<TracedBundle> traced;
        for (const Bundle& bundle : sequence.next(std::min(kBatch, count - first))) {
            traced.push_back({bundle, {}});
            projector.project(bundle, traced.back().lines);
        }
        counts.add(traced);
    }
    return counts;
}

uint64_t exchangedLines(const BundleLines& lines) {
    uint64_t sum = 0;
    for (const Exchange& e : lines.exchanges) sum += e.lines;
    return sum;
}

std::vector<bool> shownBut(const Patches& patches, uint32_t instance) {
    std::vector<bool> isShown(patches.sideCount());
    for (uint32_t side = 0; side < isShown.size(); ++side)
        isShown[side] = patches.parentAt(side).instance != instance;
    return isShown;
}

double linesOf(const LineCounts& counts, uint32_t side) {
    return double(counts.total[side][0]) + counts.total[side][1];
}

double linesBetween(const LineCounts& counts, uint32_t i, uint32_t j) {
    for (const LineCount& c : counts.row(i))
        if (c.side == j) return double(c.lines[0]) + c.lines[1];
    return 0;
}

double formFactor(const Patches& patches, const LineCounts& counts, uint32_t from, uint32_t to) {
    auto instanceOf = [&](uint32_t side) {
        return patches.parents[patches.parentOf[side / 2]].instance;
    };
    double between = 0, all = 0;
    for (uint32_t i = 0; i < counts.sideCount(); i += 2) {
        if (instanceOf(i) != from) continue;
        all += linesOf(counts, i);
        for (const LineCount& c : counts.row(i))
            if (c.side % 2 == 0 && instanceOf(c.side) == to) between += c.lines[0] + c.lines[1];
    }
    return between / all;
}

double parallelRectangles(double a, double b, double c) {
    const double x = a / c, y = b / c, x2 = 1 + x * x, y2 = 1 + y * y;
    return 2 / (kPi * x * y) *
           (0.5 * std::log(x2 * y2 / (x2 + y2 - 1)) +
            x * std::sqrt(y2) * std::atan(x / std::sqrt(y2)) +
            y * std::sqrt(x2) * std::atan(y / std::sqrt(x2)) - x * std::atan(x) - y * std::atan(y));
}

double perpendicularRectangles(double w, double h, double l) {
    const double W = w / l, H = h / l, w2 = W * W, h2 = H * H, d = std::sqrt(w2 + h2);
    const double logs = std::log((1 + w2) * (1 + h2) / (1 + w2 + h2)) +
                        w2 * std::log(w2 * (1 + w2 + h2) / ((1 + w2) * (w2 + h2))) +
                        h2 * std::log(h2 * (1 + h2 + w2) / ((1 + h2) * (h2 + w2)));
    return (W * std::atan(1 / W) + H * std::atan(1 / H) - d * std::atan(1 / d) + 0.25 * logs) /
           (kPi * W);
}

double offsetRectangles(const double (&x)[2], const double (&y)[2], const double (&u)[2],
                        const double (&v)[2], double z) {
    auto g = [z](double a, double b) {
        const double ra = std::sqrt(a * a + z * z), rb = std::sqrt(b * b + z * z);
        return (b * ra * std::atan(b / ra) + a * rb * std::atan(a / rb) -
                0.5 * z * z * std::log(a * a + b * b + z * z)) /
               (2 * kPi);
    };
    double sum = 0;
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j)
            for (int k = 0; k < 2; ++k)
                for (int l = 0; l < 2; ++l)
                    sum += ((i + j + k + l) % 2 ? -1 : 1) * g(x[i] - u[k], y[j] - v[l]);
    return sum / ((x[1] - x[0]) * (y[1] - y[0]));
}

double coaxialDisks(double r1, double r2, double h) {
    const double R1 = r1 / h, R2 = r2 / h, x = 1 + (1 + R2 * R2) / (R1 * R1);
    return 0.5 * (x - std::sqrt(x * x - 4 * (R2 / R1) * (R2 / R1)));
}

}  // namespace raybundle::test
