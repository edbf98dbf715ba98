// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/subdivision.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <map>

#include "job/cancellation.h"
#include "patches/coincidence.h"
#include "patches/crossings.h"
#include "scene/triangulation.h"

namespace raybundle {
namespace {

// A triangle is bisected along its longest edge while it is longer than this many times its height
// and than two patches: a grid of n^2 slivers would waste patches.
constexpr double kMaxElongation = 4.0;
// More elongated still, it is cut across, into as many pieces as it is long: bisections would end
// in the power 1.6 of that, one above the other.
constexpr double kNeedle = 16.0;
// Faces are left out whose height is less than this share of their longest edge; and those that are
// less high than what rounding makes of their coordinates, by this many epsilons, and so much
// longer that they are no small faces of a large scene: their normals would be rounding alone.
constexpr double kFlat = 1e-7;
constexpr double kFlatEpsilons = 4, kSliver = 1e-2;
// Share of the edge by which the fourth corner of a parallelogram may be off.
constexpr double kParallelogramTolerance = 1e-4;
constexpr int kMaxGrid = 4096;
// Solids of less thickness are sheets, of how far they lie from the centre: about what depth tells
// apart.
constexpr double kThinnest = 2e-6;

// Walks over the faces of all instances and appends vertices, cells and parents.
class Subdivision {
  public:
    // placed: with its islands in the patches.
    Subdivision(const Scene& scene, const Placement& placed, Patches& patches)
        : scene(scene), placed(placed), patches(patches) {}

    // patchSize: edge of a patch, metres; 0: the automatic ones.
    void cutFaces(float patchSize) {
        const WeldedFaces& faces = placed.faces();
        const PatchSizes& sizes = placed.sizes();
        std::vector<double> reachOf(patches.vertices.size(), 0);  // per vertex: of its island
        for (size_t f = 0; f < faces.count(); ++f)
            reachOf[faces.vertices[faces.offsets[f]]] =
                double(patches.islands[sizes.island[faces.piece[f]]].reach);
        const std::vector<Shell> shells =
            shellsOfFaces(faces, placed.closed(), patches.vertices,
                          [&](uint32_t vertex) { return kThinnest * reachOf[vertex]; });
        DoubledFaces doubled =
            findDoubledFaces(scene, faces, placed.firstVertices(), patches.vertices);
        patches.doubledCorners = std::move(doubled.corners);
        patches.anyCoincide = doubled.anyCoincide;
        std::vector<double> cellSizes;  // per cell: edge of its patches, metres
        for (size_t i = 0; i < scene.instances.size(); ++i) {
            const Mesh& mesh = scene.meshes[scene.instances[i].mesh];
            size_t degenerate = 0, doubles = 0;
            for (size_t f = 0; f < mesh.faceCount(); ++f) {
                throwIfCancelledAt(f);
                const size_t face = faces.firstFace[i] + f;
                if (doubled.isDouble[face]) {
                    ++doubles;
                    continue;
                }
                double size = patchSize > 0 ? double(patchSize) : sizes.size[faces.piece[face]];
                if (!(size > 0)) size = 1;
                Island& island = patches.islands[sizes.island[faces.piece[face]]];
                island.size = std::max(island.size, float(size));
                island.finest =
                    island.finest > 0 ? std::min(island.finest, float(size)) : float(size);
                if (!addCells(uint32_t(i), int32_t(f))) ++degenerate;
                cellSizes.resize(patches.cells.size(), size);
            }
            patches.degenerateFaces += degenerate;
            if (degenerate)
                patches.warnings.push_back(
                    {WarningId::DEGENERATE_FACES,
                     "object \"" + scene.instances[i].name + "\": " + std::to_string(degenerate) +
                         " faces without area, or with none but by rounding, were left out"});
            if (doubles)
                patches.warnings.push_back(
                    {WarningId::DOUBLED_FACES,
                     "object \"" + scene.instances[i].name + "\": " + std::to_string(doubles) +
                         " faces lie on others that look the same way, whose light they get; merge "
                         "such "
                         "faces (Merge by Distance), or remove the object if it lies on another"});
        }
        CellVertices vertices(patches.cells.size());
        for (size_t c = 0; c < vertices.size(); ++c)
            for (int k = 0; k < patches.cells[c].cornerCount(); ++k)
                vertices[c][size_t(k)] =
                    worldVertex(patches.cells[c].instance, patches.cells[c].corner[size_t(k)]);
        const Crossings crossings = findCrossings(patches.cells, cellSizes, vertices);
        if (!crossings.isAll)
            patches.warnings.push_back(
                {WarningId::UNCUT_CROSSINGS,
                 "faces go through each other in so many places that the smaller ones are not cut "
                 "there: they may let some light through walls; delete or hide what nobody sees of "
                 "objects that go through each other"});
        for (uint32_t c = 0; c < patches.cells.size(); ++c) {
            throwIfCancelledAt(c);
            if (!patches.cells[c].hasPatches) continue;
            const size_t firstParent = patches.parents.size();
            const auto crossing = crossings.ofCell.find(c);
            if (crossing != crossings.ofCell.end())
                patches.cells[c].parted = crossing->second.parted;
            const Cell& cell = patches.cells[c];
            if (crossing != crossings.ofCell.end() && !crossing->second.pieces.empty()) {
                for (const CellPiece& piece : crossing->second.pieces)
                    cutPiece(c, piece, cellSizes[c]);
                if (!cell.isTriangle() && patches.parents.size() > firstParent)
                    patches.crossedCells.push_back(
                        {{worldVertex(cell.instance, cell.corner[0]),
                          worldVertex(cell.instance, cell.corner[1]),
                          worldVertex(cell.instance, cell.corner[2]),
                          worldVertex(cell.instance, cell.corner[3])},
                         uint32_t(firstParent),
                         uint32_t(patches.parents.size() - firstParent)});
            } else {
                cutCell(c, cellSizes[c]);
            }
            const size_t face = faces.firstFace[cell.instance] + size_t(cell.face);
            for (size_t p = firstParent; p < patches.parents.size(); ++p) {
                Parent& parent = patches.parents[p];
                parent.isSolid =
                    shells[face] != Shell::OPEN &&
                    !scene.materialOf(cell.instance, size_t(cell.face)).isTranslucent();
                parent.isInward = shells[face] == Shell::INWARD;
                parent.stopsDirect = scene.instances[cell.instance].stopsDirect;
                parent.exchanges = scene.instances[cell.instance].exchanges;
                parent.island = sizes.island[faces.piece[face]];
                parent.surface = faces.surface[face];
            }
        }
        measureSurfaces(faces.surfaceCount);
        patches.finest = INFINITY;
        for (const Island& island : patches.islands) {
            patches.size = std::max(patches.size, island.size);
            if (island.finest > 0) patches.finest = std::min(patches.finest, island.finest);
        }
        if (!(patches.finest < INFINITY)) patches.size = patches.finest = 1;
    }

  private:
    using Triangle = std::array<uint32_t, 3>;  // into Patches::vertices

    // What a parent is cut from.
    struct Origin {
        uint32_t instance;
        int32_t face;
        uint32_t cell;
        glm::vec3 normal;  // of the cell: that of a tiny piece would be rounding alone
    };

    void measureSurfaces(size_t surfaceCount) {
        std::vector<double> ofSurface(surfaceCount, 0.0), ofInstance(scene.instances.size(), 0.0);
        for (const Parent& parent : patches.parents) {
            ofSurface[parent.surface] += double(parent.area());
            ofInstance[parent.instance] += double(parent.area());
        }
        // In steps of 0.7 %, so that rounding does not order what is as large.
        auto steps = [](double area) {
            return uint32_t(
                std::clamp(100 * std::log2(std::max(area, 1e-80)) + 32768, 0.0, 65535.0));
        };
        for (Parent& parent : patches.parents)
            parent.surfaceSize =
                steps(ofInstance[parent.instance]) << 16 | steps(ofSurface[parent.surface]);
    }

    // Adds the triangles of a face, or the parallelogram that it is; returns whether any has an
    // area.
    bool addCells(uint32_t instance, int32_t face) {
        const Mesh& mesh = scene.meshes[scene.instances[instance].mesh];
        const int32_t begin = mesh.faceOffsets[face], end = mesh.faceOffsets[face + 1];
        std::vector<int32_t> corners;
        for (int32_t c = begin; c < end; ++c) corners.push_back(c);
        if (scene.instances[instance].isMirrored()) std::reverse(corners.begin(), corners.end());
        std::vector<glm::dvec3> points;
        for (int32_t c : corners) points.push_back(patches.vertices[worldVertex(instance, c)]);

        if (corners.size() == 4 && isParallelogram(points)) {
            addCell(instance, face, points[0], points[1], points[3],
                    {corners[0], corners[1], corners[2], corners[3]});
            return true;
        }
        bool any = false;
        for (const std::array<int, 3>& t : triangulate(points)) {
            addCell(instance, face, points[t[0]], points[t[1]], points[t[2]],
                    {corners[t[0]], corners[t[1]], corners[t[2]], -1});
            const bool hasArea = !isFlat(points[t[0]], points[t[1]], points[t[2]]);
            patches.cells.back().hasPatches = hasArea;
            any = any || hasArea;
        }
        return any;
    }

    void cutCell(uint32_t index, double size) {
        const Cell& cell = patches.cells[index];
        std::vector<uint32_t> vertices;
        for (int k = 0; k < cell.cornerCount(); ++k)
            vertices.push_back(worldVertex(cell.instance, cell.corner[size_t(k)]));
        const Origin of = originOf(index);
        if (cell.isTriangle())
            addPolygon(of, vertices, size);
        else
            addParallelogram(of, vertices, size);
    }

    void cutPiece(uint32_t index, const CellPiece& piece, double size) {
        const Cell& cell = patches.cells[index];
        std::vector<uint32_t> vertices;
        for (const glm::dvec3& place : piece.corners) {
            uint32_t vertex = uint32_t(patches.vertices.size());
            for (int k = 0; k < cell.cornerCount(); ++k)
                if (glm::vec3(place) == cell.position(k))
                    vertex = worldVertex(cell.instance, cell.corner[size_t(k)]);
            if (vertex == patches.vertices.size()) patches.vertices.push_back(glm::vec3(place));
            vertices.push_back(vertex);
        }
        const size_t firstParent = patches.parents.size();
        if (piece.corners.size() == 4 && isParallelogram(piece.corners))
            addParallelogram(originOf(index), vertices, size);
        else
            addPolygon(originOf(index), vertices, size);
        for (size_t p = firstParent; p < patches.parents.size(); ++p)
            patches.parents[p].seenCorners = piece.seenCorners;
    }

    void addParallelogram(const Origin& of, const std::vector<uint32_t>& v, double size) {
        Parent parent =
            makeParent(of, patches.vertices[v[0]], patches.vertices[v[1]], patches.vertices[v[3]]);
        std::copy(v.begin(), v.end(), parent.vertex.begin());
        parent.isTriangle = false;
        parent.countA = gridCount(glm::length(parent.a), size);
        parent.countB = gridCount(glm::length(parent.b), size);
        patches.parents.push_back(parent);
    }

    void addPolygon(const Origin& of, const std::vector<uint32_t>& v, double size) {
        std::vector<glm::dvec3> points;
        for (uint32_t vertex : v) points.push_back(patches.vertices[vertex]);
        for (const std::array<int, 3>& t : triangulate(points)) {
            double longest = 0;
            for (size_t k = 0; k < 3; ++k)
                longest = std::max(
                    longest, glm::distance(points[size_t(t[k])], points[size_t(t[(k + 1) % 3])]));
            cutTriangle(of, {v[size_t(t[0])], v[size_t(t[1])], v[size_t(t[2])]},
                        std::max(size, longest / kMaxGrid));
        }
    }

    uint32_t worldVertex(uint32_t instance, int32_t corner) const {
        return placed.vertex(instance,
                             scene.meshes[scene.instances[instance].mesh].cornerVertices[corner]);
    }

    static bool isParallelogram(const std::vector<glm::dvec3>& p) {
        const double longest = std::max(glm::length(p[1] - p[0]), glm::length(p[3] - p[0]));
        const double off = glm::length(p[0] - p[1] + p[2] - p[3]);
        return off <= kParallelogramTolerance * longest && !isFlat(p[0], p[1], p[3]);
    }

    // Whether a triangle, or the parallelogram that it is half of, has no area but for rounding.
    static bool isFlat(const glm::dvec3& p0, const glm::dvec3& p1, const glm::dvec3& p2) {
        const double longest =
            std::max({glm::length(p1 - p0), glm::length(p2 - p1), glm::length(p0 - p2)});
        const double height = glm::length(glm::cross(p1 - p0, p2 - p0)) / longest;
        const glm::dvec3 most = glm::max(glm::abs(p0), glm::max(glm::abs(p1), glm::abs(p2)));
        const double rounding =
            kFlatEpsilons * double(FLT_EPSILON) * std::max({most.x, most.y, most.z});
        return !(height > std::max(kFlat * longest, std::min(rounding, kSliver * longest)));
    }

    static uint16_t gridCount(double length, double size) {
        // A hundredth of a patch of slack, so that a length of exactly n patches stays n.
        return uint16_t(std::clamp(int(std::ceil(length / size - 0.01)), 1, kMaxGrid));
    }

    void addCell(uint32_t instance, int32_t face, const glm::dvec3& p0, const glm::dvec3& pa,
                 const glm::dvec3& pb, const std::array<int32_t, 4>& corner) {
        Cell cell;
        cell.origin = glm::vec3(p0);
        cell.a = glm::vec3(pa - p0);
        cell.b = glm::vec3(pb - p0);
        cell.corner = corner;
        cell.instance = instance;
        cell.face = face;
        patches.cells.push_back(cell);
    }

    Origin originOf(uint32_t index) const {
        const Cell& cell = patches.cells[index];
        return {cell.instance, cell.face, index, glm::vec3(cell.normal())};
    }

    static Parent makeParent(const Origin& of, const glm::dvec3& p0, const glm::dvec3& pa,
                             const glm::dvec3& pb) {
        Parent parent;
        parent.origin = glm::vec3(p0);
        parent.a = glm::vec3(pa - p0);
        parent.b = glm::vec3(pb - p0);
        parent.normal = of.normal;
        parent.instance = of.instance;
        parent.face = of.face;
        parent.cell = of.cell;
        parent.vertex = {0, 0, 0, 0};
        return parent;
    }

    void cutTriangle(const Origin& of, const Triangle& v, double size) {
        const glm::dvec3 p[3] = {patches.vertices[v[0]], patches.vertices[v[1]],
                                 patches.vertices[v[2]]};
        int longest = 0;
        double length[3];
        for (int k = 0; k < 3; ++k) {
            length[k] = glm::length(p[(k + 1) % 3] - p[k]);
            if (length[k] > length[longest]) longest = k;
        }
        const double doubleArea = glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
        const double height = doubleArea / length[longest];
        if (length[longest] > kMaxElongation * height && length[longest] > 2 * size &&
            hasMiddle(p[longest], p[(longest + 1) % 3])) {
            const uint32_t v0 = v[longest], v1 = v[(longest + 1) % 3], v2 = v[(longest + 2) % 3];
            const double after = length[(longest + 1) % 3], before = length[(longest + 2) % 3];
            const glm::dvec3 edge = p[(longest + 1) % 3] - p[longest];
            const double along = glm::dot(p[(longest + 2) % 3] - p[longest], edge) /
                                 (length[longest] * length[longest]);
            const glm::vec3 foot(p[longest] + along * edge);
            if (length[longest] < kNeedle * height) {
                const uint32_t middle = middleVertex(v0, v1);
                cutTriangle(of, {v0, middle, v2}, size);
                cutTriangle(of, {middle, v1, v2}, size);
            } else if (std::min(after, before) > std::max(2 * size, 2 * height) &&
                       foot != patches.vertices[v0] && foot != patches.vertices[v1]) {
                // Blunt: two needles whose short edge is the height.
                patches.vertices.push_back(foot);
                const uint32_t v3 = uint32_t(patches.vertices.size()) - 1;
                cutTriangle(of, {v0, v3, v2}, size);
                cutTriangle(of, {v3, v1, v2}, size);
            } else if (after < before) {
                cutNeedle(of, {v0, v1, v2}, size);
            } else {
                cutNeedle(of, {v1, v2, v0}, size);
            }
            return;
        }
        addTriangle(of, v, std::sqrt(0.5 * doubleArea), length[longest], size);
    }

    // A needle with its point at v[0].
    void cutNeedle(const Origin& of, const Triangle& v, double size) {
        const uint32_t right = middleVertex(v[0], v[1]), left = middleVertex(v[0], v[2]);
        cutTriangle(of, {v[0], right, left}, size);
        cutStrip(of, {right, v[1]}, {left, v[2]}, size);
    }

    // Between two edges along each other, much longer than they are apart; from `bottom` to `top`
    // is to the left.
    void cutStrip(const Origin& of, const std::array<uint32_t, 2>& bottom,
                  const std::array<uint32_t, 2>& top, double size) {
        auto isLong = [&](const std::array<uint32_t, 2>& edge) {
            const glm::vec3 &a = patches.vertices[edge[0]], &b = patches.vertices[edge[1]];
            return glm::distance(a, b) > 2 * size && hasMiddle(a, b);
        };
        if (!isLong(bottom) && !isLong(top)) {
            cutTriangle(of, {bottom[0], bottom[1], top[1]}, size);
            cutTriangle(of, {bottom[0], top[1], top[0]}, size);
            return;
        }
        const uint32_t low = middleVertex(bottom[0], bottom[1]);
        const uint32_t high = middleVertex(top[0], top[1]);
        cutStrip(of, {bottom[0], low}, {top[0], high}, size);
        cutStrip(of, {low, bottom[1]}, {high, top[1]}, size);
    }

    void addTriangle(const Origin& of, const Triangle& v, double edge, double longest,
                     double size) {
        if (!(edge > 0)) return;  // a piece of nothing, by rounding
        Parent parent =
            makeParent(of, patches.vertices[v[0]], patches.vertices[v[1]], patches.vertices[v[2]]);
        std::copy(v.begin(), v.end(), parent.vertex.begin());
        // As many patches as squares of the patch size would cover, but no edge much longer.
        parent.countA = parent.countB =
            gridCount(std::max(edge / size, longest / (2.0 * size)), 1.0);
        patches.parents.push_back(parent);
    }

    // Whether the halves of an edge are shorter than it however their end is rounded, which is by
    // half an epsilon of its coordinates: pieces of pieces else need not get smaller.
    static bool hasMiddle(const glm::vec3& a, const glm::vec3& b) {
        const glm::vec3 most = glm::max(glm::abs(a), glm::abs(b));
        return glm::distance(a, b) > 16 * FLT_EPSILON * std::max({most.x, most.y, most.z});
    }

    // Neighbouring faces that bisect the same edge share the new vertex.
    uint32_t middleVertex(uint32_t v0, uint32_t v1) {
        const auto key = std::minmax(v0, v1);
        const auto found = middles.find(key);
        if (found != middles.end()) return found->second;
        patches.vertices.push_back(0.5f * (patches.vertices[v0] + patches.vertices[v1]));
        const uint32_t middle = uint32_t(patches.vertices.size()) - 1;
        middles.emplace(key, middle);
        return middle;
    }

    const Scene& scene;
    const Placement& placed;
    Patches& patches;
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
};

}  // namespace

void cutFaces(const Scene& scene, const Placement& placed, float patchSize, Patches& patches) {
    Subdivision(scene, placed, patches).cutFaces(patchSize);
}

}  // namespace raybundle
