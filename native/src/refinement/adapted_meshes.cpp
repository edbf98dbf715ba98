// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/adapted_meshes.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "job/cancellation.h"
#include "patches/side.h"
#include "refinement/adapted_mesh.h"
#include "refinement/discontinuity_lines.h"
#include "refinement/source_light.h"

namespace raybundle {
namespace {

// Share of the squared error whose triangles are refined in a round.
constexpr double kBulk = 0.3;
// Share of the vertices that is left to the improvement of angles.
constexpr double kForAngles = 0.1;
// Objects whose stated error is below this share of the target keep their meshes.
constexpr double kWorthMesh = 0.5;
// Lines are searched in meshes whose errors are this many targets. With large triangles, more soft
// edges are narrow; with small ones, more of the lines are found.
constexpr double kForLines[] = {4, 2};
// Lines in smaller triangles are more accurate, and are taken if they show this share of the jumps.
constexpr double kAsMany = 0.9;
// Share of the squared error that a mesh may have, up to which lines may replace soft edges.
constexpr double kOfLines = 0.5;
// Lines are used if they take at most this many times the vertices: at equal error, the crisp edge
// of a shadow looks better than the jagged one of small triangles.
constexpr double kForCrisp = 1.1;
constexpr int kMostRounds = 100;

using Meshes = std::vector<std::unique_ptr<AdaptedMesh>>;
using Lines = std::vector<DiscontinuityLine>;

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

size_t vertexCount(const Meshes& meshes) {
    return std::accumulate(meshes.begin(), meshes.end(), size_t(0),
                           [](size_t sum, const auto& m) { return sum + m->mesh().vertexCount(); });
}

// The meshes of a scene while they are adapted, all together.
class Adaptation {
  public:
    // `these` are the instances, and `mostVertices` is the limit of all their vertices together.
    // References must outlive the object.
    Adaptation(const KnownLight& known, const std::vector<InstanceRange>& ranges,
               const std::vector<size_t>& these, size_t mostVertices, const Progress& progress,
               Report& report)
        : known(known),
          ranges(ranges),
          these(these),
          mostVertices(mostVertices),
          progress(progress),
          report(report),
          shown(known, ranges) {
        for (size_t i : these) meshes.push_back(adaptedMesh(i));
    }

    // Refines the meshes until their errors are as small as wanted. Does so again from lines on,
    // across which the light jumps, and keeps the result where that takes few vertices. Returns
    // whether there were vertices enough.
    bool run() {
        // With POINT, vertices on a line would gather the light of either side by chance.
        if (!known.settings.discontinuityLines ||
            known.settings.reconstruction == Reconstruction::POINT)
            return toTarget(1);
        bool isEnough = true;
        std::vector<Lines> lines(meshes.size());
        for (const double targets : kForLines) {
            isEnough = isEnough && toTarget(targets);
            for (size_t m = 0; m < meshes.size(); ++m)
                if (Lines found = worthwhileLines(*meshes[m]);
                    steps(found) > kAsMany * steps(lines[m]))
                    lines[m] = std::move(found);
        }
        isEnough = isEnough && toTarget(1);
        Meshes without = startFrom(lines);
        std::vector<double> errors;  // per mesh: its error without lines
        for (const auto& mesh : without) {
            std::vector<TriangleError> ofTriangles;
            errors.push_back(mesh ? mesh->addErrors(0, ofTriangles) : INFINITY);
        }
        const bool isNowEnough = refineWhile([&] { return marksAbove(errors); });
        if (isEnough) goBack(without, isNowEnough);
        return isEnough || isNowEnough;
    }

    // Returns the mesh of an instance, given by its number among `these`.
    FinerMesh result(size_t m) const { return meshes[m]->mesh().result(); }

  private:
    std::unique_ptr<AdaptedMesh> adaptedMesh(size_t instance, const Lines& lines = {},
                                             size_t most = SIZE_MAX) const {
        return std::make_unique<AdaptedMesh>(known, uint32_t(instance), ranges[instance],
                                             shown.meanSquare, lines, most);
    }

    // Refines the meshes until their errors are below some targets. Returns whether there were
    // vertices enough for that.
    bool toTarget(double targets) {
        return refineWhile([&] { return marksAbove(targets * targets); });
    }

    // Measures the meshes and refines the triangles that `marked` returns, until it returns none.
    // Returns whether there were vertices enough for that. All triangles are measured then.
    template <class Marked>
    bool refineWhile(const Marked& marked) {
        bool isEnough = true;
        for (int round = 0; round < kMostRounds && isEnough; ++round) {
            measure();
            const std::vector<TriangleError> marks = marked();
            if (marks.empty()) return true;
            isEnough = refine(marks);
        }
        measure();
        return isEnough;
    }

    // Returns the lines of a mesh, without those that are so soft that they would be a large part
    // of the error which the mesh may have.
    Lines worthwhileLines(const AdaptedMesh& mesh) {
        Lines lines = discontinuityLines(known, mesh, progress, report);
        std::sort(lines.begin(), lines.end(), [](const auto& a, const auto& b) {
            return a.jump * a.jump * a.width < b.jump * b.jump * b.width;
        });
        double left = kOfLines * mesh.allowedSum(shown.area);
        size_t count = 0;
        while (count < lines.size() && (left -= lines[count].square()) >= 0) ++count;
        lines.resize(count);
        return lines;
    }

    // Returns how much of the jumps of the light lines show, (W/m^2)^2 m.
    static double steps(const Lines& lines) {
        double sum = 0;
        for (const DiscontinuityLine& line : lines) sum += line.jump * line.jump * line.length();
        return sum;
    }

    // Replaces the meshes that have lines by those that start from them, and returns the replaced.
    Meshes startFrom(const std::vector<Lines>& lines) {
        Meshes replaced(meshes.size());
        std::vector<LightQuery> queries;
        std::vector<uint32_t> meshOf;
        size_t count = vertexCount(meshes);
        for (size_t m = 0; m < meshes.size(); ++m) {
            if (lines[m].empty()) continue;
            count -= meshes[m]->mesh().vertexCount();
            replaced[m] = std::move(meshes[m]);
            meshes[m] =
                adaptedMesh(these[m], lines[m], mostVertices - std::min(mostVertices, count));
            count += meshes[m]->mesh().vertexCount();
            meshes[m]->addMixedTiles(queries);
            meshOf.resize(queries.size(), uint32_t(m));
        }
        answer(queries, meshOf);
        improveAngles();
        return replaced;
    }

    // Measures the errors of new triangles. Gathers the light of the sources where they want it.
    void measure() {
        std::vector<LightQuery> queries;
        std::vector<uint32_t> meshOf;
        std::vector<std::vector<uint32_t>> wanting;
        for (uint32_t m = 0; m < meshes.size(); ++m) {
            wanting.push_back(meshes[m]->measure());
            for (uint32_t triangle : wanting.back()) meshes[m]->addPoints(triangle, queries);
            meshOf.resize(queries.size(), m);
        }
        answer(queries, meshOf);
        for (size_t m = 0; m < meshes.size(); ++m)
            parallelFor(size_t(0), wanting[m].size(),
                        [&](size_t k) { meshes[m]->measureAtPoints(wanting[m][k]); });
    }

    // Gathers the light that is wanted. `meshOf` is the number of the mesh of each query.
    void answer(const std::vector<LightQuery>& queries, const std::vector<uint32_t>& meshOf) {
        std::vector<Receiver> receivers;
        for (const LightQuery& query : queries)
            if (query.receiver) receivers.push_back(*query.receiver);
        const SourceLight light =
            gatherSources(known, receivers, known.settings.targetError, progress, report);
        for (size_t q = 0, r = 0; q < queries.size(); ++q) {
            const bool isGathered = queries[q].receiver.has_value();
            meshes[meshOf[q]]->setLight(queries[q], isGathered ? light.light[r] : glm::vec3(0.0f),
                                        isGathered ? light.variance[r] : 0.0f);
            r += isGathered;
        }
    }

    // Returns the triangles to be refined next, by decreasing error, as long as squared errors are
    // above `allowed` times those of the target.
    std::vector<TriangleError> marksAbove(double allowed) const {
        std::vector<TriangleError> all, marks;
        double sum = 0;
        for (uint32_t m = 0; m < meshes.size(); ++m) {
            std::vector<TriangleError> own;
            const double ofMesh = meshes[m]->addErrors(m, own);
            sum += ofMesh;
            if (meshes[m]->isTooMuch(ofMesh / allowed)) markLargest(meshes, own, ofMesh, marks);
            all.insert(all.end(), own.begin(), own.end());
        }
        if (sum > allowed * shown.area) markLargest(meshes, all, sum, marks);
        std::sort(marks.begin(), marks.end());
        return marks;
    }

    // Returns the triangles to be refined next, by decreasing error, of the meshes whose squared
    // error is above `allowed`, which is per mesh.
    std::vector<TriangleError> marksAbove(const std::vector<double>& allowed) const {
        std::vector<TriangleError> marks;
        for (uint32_t m = 0; m < meshes.size(); ++m) {
            if (allowed[m] == INFINITY) continue;
            std::vector<TriangleError> own;
            const double ofMesh = meshes[m]->addErrors(m, own);
            if (ofMesh > allowed[m]) markLargest(meshes, own, ofMesh, marks);
        }
        std::sort(marks.begin(), marks.end());
        return marks;
    }

    // Puts back the meshes `without` lines whose lines take too many vertices. Puts back all if
    // there were not enough vertices, or too many in the end.
    void goBack(Meshes& without, bool isEnough) {
        auto count = [](const auto& mesh) { return mesh->mesh().vertexCount(); };
        std::vector<uint8_t> isWorse(meshes.size(), 0);
        size_t sum = 0;
        for (size_t m = 0; m < meshes.size(); ++m) {
            isWorse[m] =
                without[m] && double(count(meshes[m])) > kForCrisp * double(count(without[m]));
            sum += count(isWorse[m] ? without[m] : meshes[m]);
        }
        for (size_t m = 0; m < meshes.size(); ++m)
            if (without[m] && (isWorse[m] || !isEnough || sum > mostVertices))
                meshes[m] = std::move(without[m]);
    }

    // Refines triangles in this order. Returns whether there were vertices left for all.
    bool refine(const std::vector<TriangleError>& marks) {
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
        improveAngles();
        return isEnough;
    }

    void improveAngles() {
        size_t count = vertexCount(meshes);
        for (const auto& adapted : meshes) {
            RefinedMesh& mesh = adapted->mesh();
            const size_t before = mesh.vertexCount();
            mesh.improve(before + (mostVertices > count ? mostVertices - count : 0));
            count += mesh.vertexCount() - before;
        }
    }

    const KnownLight& known;
    const std::vector<InstanceRange>& ranges;
    const std::vector<size_t>& these;
    const size_t mostVertices;
    const Progress& progress;
    Report& report;
    const ShownArea shown;
    Meshes meshes;
};

}  // namespace

std::vector<FinerMesh> adaptMeshes(const KnownLight& known,
                                   const std::vector<InstanceRange>& ranges,
                                   const Progress& progress, Report& report) {
    const Scene& scene = known.scene;
    const size_t mostOfAll = size_t(known.settings.maxVertices);
    std::vector<FinerMesh> result(scene.instances.size());
    const std::vector<bool> isAllGathered = known.shown.instancesAllGathered();
    std::vector<size_t> worthwhile;
    size_t vertices = 0, kept = 0;  // of all meshes, and of those that stay as they are
    for (size_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        if (instance.role != RB_ROLE_BAKE) continue;
        const Mesh& mesh = scene.meshes[size_t(instance.mesh)];
        const Report::Errors& error = report.objects[i].error;
        // What nodes lose between the places where they gather is not an error of the mesh.
        const double ofMesh = std::hypot(error.mesh, isAllGathered[i] ? 0.0 : error.discretisation);
        const bool isWorth =
            ofMesh > kWorthMesh * double(instance.noiseFactor * known.settings.targetError);
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
    Adaptation adaptation(known, ranges, worthwhile, mostOfAll - kept, progress, report);
    const bool isEnough = adaptation.run();
    if (!isEnough)
        report.warn(WarningId::MAX_VERTICES,
                    "max_vertices (" + std::to_string(mostOfAll) +
                        ") was reached before the meshes could follow the light to the target; "
                        "raise max_vertices, or raise target_error");
    for (size_t m = 0; m < worthwhile.size(); ++m) result[worthwhile[m]] = adaptation.result(m);
    return result;
}

}  // namespace raybundle
