// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/face_cutting.h"

#include <algorithm>
#include <cmath>

#include "job/cancellation.h"
#include "patches/coincidence.h"
#include "patches/crossings.h"
#include "patches/doubled_faces.h"
#include "patches/parent_cutting.h"
#include "scene/triangulation.h"

namespace raybundle {
namespace {

// Closed surfaces that are thinner than this share of their distance from the centre are treated as
// sheets. The resolution of depth is about as large.
constexpr double kThinnest = 2e-6;

// Walks over the faces of all instances and adds vertices, cells and parents to the patches.
class FaceCutting {
  public:
    // `patches` must hold the islands of `placed`. Keeps references to all arguments.
    FaceCutting(const Scene& scene, const Placement& placed, Patches& patches)
        : scene(scene),
          placed(placed),
          faces(placed.faces()),
          sizes(placed.sizes()),
          patches(patches),
          cutting(patches) {}

    // `patchSize` is the edge length of a patch, m; 0 takes the automatic sizes. Each instance has
    // a factor on it.
    void run(float patchSize) {
        const std::vector<Shell> shells = findShells();
        DoubledFaces doubled =
            findDoubledFaces(scene, faces, placed.firstVertices(), patches.vertices);
        patches.doubledCorners = std::move(doubled.corners);
        patches.anyCoincide = doubled.anyCoincide;
        patches.cells.reserve(faces.count());
        cellSizes.reserve(faces.count());
        for (size_t i = 0; i < scene.instances.size(); ++i) addInstance(i, patchSize, doubled);
        const Crossings crossings = findCrossings(patches.cells, cellSizes, cellVertices());
        if (!crossings.isAll)
            patches.warnings.push_back(
                {WarningId::UNCUT_CROSSINGS,
                 "faces intersect in so many places that the smaller faces were not cut there. "
                 "Some light may leak through walls; delete or hide the unseen parts of objects "
                 "that intersect"});
        patches.parents.reserve(patches.cells.size());
        for (uint32_t c = 0; c < patches.cells.size(); ++c) {
            throwIfCancelledAt(c);
            if (patches.cells[c].hasPatches) addParents(c, crossings, shells);
        }
        measureSurfaces();
        measureSizes();
    }

  private:
    // Returns per face whether it belongs to a solid.
    std::vector<Shell> findShells() const {
        // Per vertex: reach of its island, m.
        std::vector<double> reachOf(patches.vertices.size(), 0);
        for (size_t f = 0; f < faces.count(); ++f)
            reachOf[faces.vertices[faces.offsets[f]]] =
                double(patches.islands[sizes.island[faces.piece[f]]].reach);
        return shellsOfFaces(faces, placed.closed(), patches.vertices,
                             [&](uint32_t vertex) { return kThinnest * reachOf[vertex]; });
    }

    // Adds the cells of an instance, and warnings of faces that have none.
    void addInstance(size_t i, float patchSize, const DoubledFaces& doubled) {
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
            size *= double(scene.instances[i].patchFactor);
            Island& island = patches.islands[sizes.island[faces.piece[face]]];
            island.size = std::max(island.size, float(size));
            island.finest = island.finest > 0 ? std::min(island.finest, float(size)) : float(size);
            if (!addCells(uint32_t(i), int32_t(f))) ++degenerate;
            cellSizes.resize(patches.cells.size(), size);
        }
        patches.degenerateFaces += degenerate;
        if (degenerate)
            patches.warnings.push_back(
                {WarningId::DEGENERATE_FACES,
                 "object \"" + scene.instances[i].name + "\": " + std::to_string(degenerate) +
                     " faces were left out, because their area is zero or no larger than rounding "
                     "errors; remove them (Degenerate Dissolve)"});
        if (doubles)
            patches.warnings.push_back(
                {WarningId::DOUBLED_FACES,
                 "object \"" + scene.instances[i].name + "\": " + std::to_string(doubles) +
                     " faces lie on others that face the same way, and get the light of those "
                     "faces; merge them (Merge by Distance), or delete the object if it lies on "
                     "another object"});
    }

    // Returns the vertices of each cell's corners.
    CellVertices cellVertices() const {
        CellVertices vertices(patches.cells.size());
        for (size_t c = 0; c < vertices.size(); ++c)
            for (int k = 0; k < patches.cells[c].cornerCount(); ++k)
                vertices[c][size_t(k)] =
                    worldVertex(patches.cells[c].instance, patches.cells[c].corner[size_t(k)]);
        return vertices;
    }

    // Cuts a cell into parents and sets their properties.
    void addParents(uint32_t c, const Crossings& crossings, const std::vector<Shell>& shells) {
        const size_t firstParent = patches.parents.size();
        const auto crossing = crossings.ofCell.find(c);
        if (crossing != crossings.ofCell.end()) patches.cells[c].parted = crossing->second.parted;
        const Cell& cell = patches.cells[c];
        if (crossing != crossings.ofCell.end() && !crossing->second.pieces.empty()) {
            for (const CellPiece& piece : crossing->second.pieces) cutPiece(c, piece, cellSizes[c]);
            if (!cell.isTriangle() && patches.parents.size() > firstParent)
                patches.crossedCells.push_back({{worldVertex(cell.instance, cell.corner[0]),
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
            parent.isSolid = shells[face] != Shell::OPEN &&
                             !scene.materialOf(cell.instance, size_t(cell.face)).isTranslucent();
            parent.isInward = shells[face] == Shell::INWARD;
            parent.stopsDirect = scene.instances[cell.instance].stopsDirect;
            parent.exchanges = scene.instances[cell.instance].exchanges;
            parent.isAdapted = scene.instances[cell.instance].isAdapted;
            parent.island = sizes.island[faces.piece[face]];
            parent.surface = faces.surface[face];
        }
    }

    // Sets the largest and smallest target sizes over all islands.
    void measureSizes() {
        patches.finest = INFINITY;
        for (const Island& island : patches.islands) {
            patches.size = std::max(patches.size, island.size);
            if (island.finest > 0) patches.finest = std::min(patches.finest, island.finest);
        }
        if (!(patches.finest < INFINITY)) patches.size = patches.finest = 1;
    }

    // Sets Parent::surfaceSize. Its upper 16 bits are the area of the object, its lower 16 bits the
    // area of the surface, both on a logarithmic scale.
    void measureSurfaces() {
        std::vector<double> ofSurface(faces.surfaceCount, 0.0),
            ofInstance(scene.instances.size(), 0.0);
        for (const Parent& parent : patches.parents) {
            ofSurface[parent.surface] += double(parent.area());
            ofInstance[parent.instance] += double(parent.area());
        }
        // In steps of 0.7 %, so that rounding does not order surfaces of equal area.
        auto steps = [](double area) {
            return uint32_t(
                std::clamp(100 * std::log2(std::max(area, 1e-80)) + 32768, 0.0, 65535.0));
        };
        for (Parent& parent : patches.parents)
            parent.surfaceSize =
                steps(ofInstance[parent.instance]) << 16 | steps(ofSurface[parent.surface]);
    }

    // Adds the cells of a face: one if it is a parallelogram, otherwise triangles. Returns whether
    // any of them has an area.
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

    // Cuts a whole cell into parents. `size` is the edge length of a patch, m.
    void cutCell(uint32_t index, double size) {
        const Cell& cell = patches.cells[index];
        std::vector<uint32_t> vertices;
        for (int k = 0; k < cell.cornerCount(); ++k)
            vertices.push_back(worldVertex(cell.instance, cell.corner[size_t(k)]));
        if (cell.isTriangle())
            cutting.addPolygon(index, vertices, size);
        else
            cutting.addParallelogram(index, vertices, size);
    }

    // Cuts a piece of a cell into parents. Adds its corners as vertices unless they are those of
    // the cell.
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
            cutting.addParallelogram(index, vertices, size);
        else
            cutting.addPolygon(index, vertices, size);
        for (size_t p = firstParent; p < patches.parents.size(); ++p)
            patches.parents[p].seenCorners = piece.seenCorners;
    }

    // Returns the index in Patches::vertices of a corner of an instance's mesh.
    uint32_t worldVertex(uint32_t instance, int32_t corner) const {
        return placed.vertex(instance,
                             scene.meshes[scene.instances[instance].mesh].cornerVertices[corner]);
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

    const Scene& scene;
    const Placement& placed;
    const WeldedFaces& faces;
    const PatchSizes& sizes;
    Patches& patches;
    std::vector<double> cellSizes;  // per cell: edge length of its patches, m
    ParentCutting cutting;
};

}  // namespace

void cutFaces(const Scene& scene, const Placement& placed, float patchSize, Patches& patches) {
    FaceCutting(scene, placed, patches).run(patchSize);
}

}  // namespace raybundle
