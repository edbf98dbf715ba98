// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/adapted_meshes.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "job/cancellation.h"
#include "patches/side.h"
#include "refinement/adapted_mesh.h"

namespace raybundle {
namespace {

// Share of the squared error whose triangles are refined in a round.
constexpr double kBulk = 0.3;
// Share of the vertices that is left to the improvement of angles.
constexpr double kForAngles = 0.1;
// Objects whose stated error is below this share of the target keep their meshes.
constexpr double kWorthMesh = 0.5;
constexpr int kMostRounds = 100;

using Meshes = std::vector<std::unique_ptr<AdaptedMesh>>;

// The exposed area of the shown sides of all baked objects, m^2, and the mean square of the light
// on it, summed over RGB, (W/m^2)^2.
struct ShownArea {
    double area = 0, meanSquare = 0;

    ShownArea(const KnownLight& known, const std::vector<InstanceRange>& ranges) {
        const Patches& tiles = known.tiles.patches();
        for (size_t i = 0; i < ranges.size(); ++i) {
            const Instance& instance = known.scene.instances[i];
            if (instance.role != RB_ROLE_BAKE) continue;
            for (uint32_t p = ranges[i].firstParent; p < ranges[i].lastParent; ++p) {
                throwIfCancelledAt(p);
                const Parent& parent = tiles.parents[p];
                for (uint32_t k = 0; k < parent.patchCount(); ++k) {
                    const uint32_t side =
                        sideOf(parent.firstPatch + k, instance.side == RB_SIDE_BACK);
                    const double weight = LitSurfaces{tiles, known.sides.exposed}.exposedArea(side);
                    const glm::dvec3 light(known.sides.irradiance.all(side));
                    meanSquare += weight * glm::dot(light, light);
                    area += weight;
                }
            }
        }
        if (area > 0) meanSquare /= area;
    }
};

// Measures the errors of new triangles. Gathers the light of the sources where they want it.
void measure(const KnownLight& known, const Meshes& meshes, const Progress& progress,
             Report& report) {
    std::vector<LightQuery> queries;
    std::vector<uint32_t> meshOf;
    std::vector<std::vector<uint32_t>> wanting;
    for (uint32_t m = 0; m < meshes.size(); ++m) {
        wanting.push_back(meshes[m]->measure());
        for (uint32_t triangle : wanting.back()) meshes[m]->addPoints(triangle, queries);
        meshOf.resize(queries.size(), m);
    }
    std::vector<uint32_t> gathering;
    for (uint32_t q = 0; q < queries.size(); ++q)
        if (queries[q].receiver) gathering.push_back(q);
    std::vector<glm::vec3> ofSources(queries.size(), glm::vec3(0.0f));
    std::vector<float> variance(queries.size(), 0.0f);
    for (size_t k = 0; k < known.lights.size(); ++k) {
        const Progress part = progress.part(k, known.lights.size());
        const std::vector<Gathered> gathered = known.lights[k].direct.gather(
            gathering.size(), [&](size_t r) { return *queries[gathering[r]].receiver; },
            known.settings.targetError,
            [&](double done) { part.report(RB_STAGE_RECONSTRUCTION, done); });
        for (size_t r = 0; r < gathering.size(); ++r) {
            const uint32_t q = gathering[r], side = queries[q].receiver->side;
            ofSources[q] +=
                known.shown.byAngle(side, gathered[r].meanAngles()) * gathered[r].irradiance;
            variance[q] += gathered[r].variance;
            report.shadowRays += gathered[r].rays;
        }
    }
    for (size_t q = 0; q < queries.size(); ++q)
        meshes[meshOf[q]]->setLight(queries[q], ofSources[q], variance[q]);
    for (size_t m = 0; m < meshes.size(); ++m)
        parallelFor(size_t(0), wanting[m].size(),
                    [&](size_t k) { meshes[m]->measureAtPoints(wanting[m][k]); });
}

// Appends the triangles with the largest errors, which together have the share kBulk of `sum`, the
// sum of all errors. Sorts the errors.
void markLargest(const Meshes& meshes, std::vector<TriangleError>& errors, double sum,
                 std::vector<TriangleError>& marks) {
    std::sort(errors.begin(), errors.end());
    double marked = 0;
    for (const TriangleError& error : errors) {
        if (marked > kBulk * sum) break;
        if (!meshes[error.mesh]->isDivisible(error.triangle)) continue;
        marked += error.square;
        marks.push_back(error);
    }
}

// Returns the triangles to be refined next, by decreasing error. `area` is that of the scene, m^2.
std::vector<TriangleError> markedTriangles(const Meshes& meshes, double area) {
    std::vector<TriangleError> all, marks;
    double sum = 0;
    for (uint32_t m = 0; m < meshes.size(); ++m) {
        std::vector<TriangleError> own;
        const double ofMesh = meshes[m]->addErrors(m, own);
        sum += ofMesh;
        if (meshes[m]->isTooMuch(ofMesh)) markLargest(meshes, own, ofMesh, marks);
        all.insert(all.end(), own.begin(), own.end());
    }
    if (sum > area) markLargest(meshes, all, sum, marks);
    std::sort(marks.begin(), marks.end());
    return marks;
}

size_t vertexCount(const Meshes& meshes) {
    return std::accumulate(meshes.begin(), meshes.end(), size_t(0),
                           [](size_t sum, const auto& m) { return sum + m->mesh().vertexCount(); });
}

// Refines triangles in this order. Returns whether there were vertices left for all.
bool refine(const Meshes& meshes, const std::vector<TriangleError>& marks, size_t mostVertices) {
    size_t count = vertexCount(meshes);
    const auto forLight = size_t(double(mostVertices) * (1 - kForAngles));
    bool isEnough = true;
    for (const TriangleError& mark : marks) {
        throwIfCancelledAt(count);
        if (count >= forLight) {
            isEnough = false;
            break;
        }
        RefinedMesh& mesh = meshes[mark.mesh]->mesh();
        const size_t before = mesh.vertexCount();
        mesh.refine(mark.triangle, before + (mostVertices > count ? mostVertices - count : 0));
        count += mesh.vertexCount() - before;
    }
    for (const auto& adapted : meshes) {
        RefinedMesh& mesh = adapted->mesh();
        const size_t before = mesh.vertexCount();
        mesh.improve(before + (mostVertices > count ? mostVertices - count : 0));
        count += mesh.vertexCount() - before;
    }
    return isEnough;
}

}  // namespace

std::vector<FinerMesh> adaptMeshes(const KnownLight& known,
                                   const std::vector<InstanceRange>& ranges,
                                   const Progress& progress, Report& report) {
    const Scene& scene = known.scene;
    const size_t mostOfAll = size_t(known.settings.maxVertices);
    std::vector<FinerMesh> result(scene.instances.size());
    std::vector<size_t> worthwhile;
    size_t vertices = 0, kept = 0;  // of all meshes, and of those that stay as they are
    for (size_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        if (instance.role != RB_ROLE_BAKE) continue;
        const Mesh& mesh = scene.meshes[size_t(instance.mesh)];
        const Report::Errors& error = report.objects[i].error;
        const bool isWorth = std::hypot(error.mesh, error.discretisation) >
                             kWorthMesh * double(instance.noiseFactor * known.settings.targetError);
        if (isWorth) worthwhile.push_back(i);
        result[i] = FinerMesh::of(mesh);
        vertices += mesh.vertices.size();
        kept += isWorth ? 0 : mesh.vertices.size();
    }
    if (worthwhile.empty()) return result;
    if (vertices >= mostOfAll) {
        report.warn(WarningId::MAX_VERTICES,
                    "max_vertices (" + std::to_string(mostOfAll) + ") is not more than the " +
                        std::to_string(vertices) +
                        " vertices that the meshes have, so that none is added for the light; "
                        "raise max_vertices");
        return result;
    }
    const ShownArea shown(known, ranges);
    Meshes meshes;
    for (size_t i : worthwhile)
        meshes.push_back(
            std::make_unique<AdaptedMesh>(known, uint32_t(i), ranges[i], shown.meanSquare));
    const size_t most = mostOfAll - kept;
    bool isEnough = true;
    for (int round = 0; round < kMostRounds && isEnough; ++round) {
        measure(known, meshes, progress, report);
        const std::vector<TriangleError> marks = markedTriangles(meshes, shown.area);
        if (marks.empty()) break;
        isEnough = refine(meshes, marks, most);
    }
    if (!isEnough)
        report.warn(WarningId::MAX_VERTICES,
                    "max_vertices (" + std::to_string(mostOfAll) +
                        ") was reached before the meshes could follow the light to the target; "
                        "raise max_vertices, or raise target_error");
    for (size_t m = 0; m < meshes.size(); ++m) result[worthwhile[m]] = meshes[m]->mesh().result();
    return result;
}

}  // namespace raybundle
