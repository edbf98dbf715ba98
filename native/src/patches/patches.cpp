// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/patches.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <map>

#include "bake/error.h"
#include "patches/coincidence.h"
#include "patches/placement.h"
#include "patches/reflectance.h"
#include "scene/triangulation.h"

namespace raybundle {

namespace {

// A patch of a regular grid over the unit square or the unit triangle, and a place in it: the same
// affine coordinates in the patch as the grid has in the parent.
struct GridPlace {
    uint32_t index;
    glm::vec2 inside;
};

GridPlace placeAt(bool isTriangle, int countA, int countB, glm::vec2 st) {
    const glm::vec2 at = st * glm::vec2(countA, countB);
    const int row = int(std::clamp(at.y, 0.0f, float(countB - 1)));
    // Row t of a triangle has n - row upright triangles with n - row - 1 upside-down ones between.
    const int columns = isTriangle ? countA - row : countA;
    const int column = int(std::clamp(at.x, 0.0f, float(columns - 1)));
    const glm::vec2 inside = at - glm::vec2(column, row);
    if (!isTriangle) return {uint32_t(row * countA + column), inside};
    const bool upsideDown = inside.x + inside.y > 1.0f && column < columns - 1;
    return {uint32_t(row * (2 * countA - row) + 2 * column + (upsideDown ? 1 : 0)),
            upsideDown ? 1.0f - inside : inside};
}

// The reverse.
glm::vec2 pointAt(bool isTriangle, int countA, int countB, const GridPlace& place) {
    const uint32_t index = place.index;
    if (!isTriangle)
        return {(index % countA + place.inside.x) / countA,
                (index / countA + place.inside.y) / countB};
    const int n = countA;
    // Invert row * (2n - row) <= index; float rounding is put right by the two loops.
    int row = int(n - std::sqrt(std::max(0.0, double(n) * n - index)));
    while (row > 0 && uint32_t(row * (2 * n - row)) > index) --row;
    while (uint32_t((row + 1) * (2 * n - row - 1)) <= index) ++row;
    const int inRow = int(index) - row * (2 * n - row);
    const glm::vec2 base(inRow / 2, row);
    return (inRow % 2 ? base + 1.0f - place.inside : base + place.inside) / float(n);
}

}  // namespace

uint32_t Parent::tileOf(uint32_t patchInParent) const {
    if (!cut) return patchInParent;
    const auto& first = cut->first;
    return uint32_t(std::upper_bound(first.begin(), first.end(), patchInParent) - first.begin()) -
           1;
}

uint32_t Parent::patchAt(float s, float t) const {
    const GridPlace tile = placeAt(isTriangle, countA, countB, {s, t});
    if (!cut) return tile.index;
    const int n = 1 << cut->level[tile.index];
    const uint32_t first = cut->first[tile.index];
    return n == 1 ? first : first + placeAt(isTriangle, n, n, tile.inside).index;
}

glm::vec2 Parent::pointOn(uint32_t patchInParent, glm::vec2 uv) const {
    // Fold the unit square onto the lower triangle.
    if (isTriangle && uv.x + uv.y > 1.0f) uv = 1.0f - uv;
    if (!cut) return pointAt(isTriangle, countA, countB, {patchInParent, uv});
    const uint32_t tile = tileOf(patchInParent);
    const int n = 1 << cut->level[tile];
    if (n > 1) uv = pointAt(isTriangle, n, n, {patchInParent - cut->first[tile], uv});
    return pointAt(isTriangle, countA, countB, {tile, uv});
}

namespace {

// The s and t with d = s a + t b, by the dual basis; d is projected into the plane of a and b. In
// double precision: the fourth power of a length underflows in float at 1e-10 m, and the difference
// keeps no digit of slivers 4000 times as long as wide.
std::pair<float, float> affine(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& d) {
    const double aa = glm::dot(a, a), ab = glm::dot(a, b), bb = glm::dot(b, b);
    const double det = aa * bb - ab * ab;
    return {float((bb * glm::dot(d, a) - ab * glm::dot(d, b)) / det),
            float((aa * glm::dot(d, b) - ab * glm::dot(d, a)) / det)};
}

}  // namespace

std::array<float, 4> Cell::weights(const glm::vec3& point) const {
    const auto [s, t] = affine(a, b, glm::dvec3(point) - glm::dvec3(origin));
    if (isTriangle()) return {1 - s - t, s, t, 0};
    return {(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t};
}

glm::vec3 Patches::point(uint32_t patch, glm::vec2 uv) const {
    const Parent& parent = parents[parentOf[patch]];
    return parent.position(parent.pointOn(patch - parent.firstPatch, uv));
}

uint32_t Patches::patchAt(uint32_t parentIndex, const glm::vec3& point) const {
    const Parent& parent = parents[parentIndex];
    const auto [s, t] = affine(parent.a, parent.b, glm::dvec3(point) - glm::dvec3(parent.origin));
    return parent.firstPatch + parent.patchAt(s, t);
}

namespace {

// A triangle is bisected along its longest edge while it is longer than this many times its height
// and than two patches: a grid of n^2 slivers would waste patches.
constexpr double kMaxElongation = 4.0;
// More elongated still, it is cut across, into as many pieces as it is long: bisections would end in
// the power 1.6 of that, one above the other.
constexpr double kNeedle = 16.0;
// Faces are left out whose height is less than this share of their longest edge; and those that are
// less high than what rounding makes of their coordinates, by this many epsilons, and so much longer
// that they are no small faces of a large scene: their normals would be rounding alone.
constexpr double kFlat = 1e-7;
constexpr double kFlatEpsilons = 4, kSliver = 1e-2;
// Share of the edge by which the fourth corner of a parallelogram may be off.
constexpr double kParallelogramTolerance = 1e-4;
constexpr int kMaxGrid = 4096;
// Solids of less thickness are sheets, of how far they lie from the centre: about what depth tells
// apart.
constexpr double kThinnest = 2e-6;
// Surfaces not further apart than these shares of an island's radius and of its finest patches
// touch; far from the centre, where rounding tells less apart, than this share of how far it is.
constexpr float kTouchOfRadius = 1e-4f, kTouchOfPatch = 0.02f, kTouchOfDistance = 1e-6f;

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
        for (size_t i = 0; i < scene.instances.size(); ++i) {
            const Mesh& mesh = scene.meshes[scene.instances[i].mesh];
            size_t degenerate = 0, doubles = 0;
            for (size_t f = 0; f < mesh.faceCount(); ++f) {
                const size_t firstParent = patches.parents.size(), face = faces.firstFace[i] + f;
                if (doubled.isDouble[face]) {
                    ++doubles;
                    continue;
                }
                const uint32_t surface = faces.surface[face];
                double size = patchSize > 0 ? double(patchSize) : sizes.size[faces.piece[face]];
                if (!(size > 0)) size = 1;
                Island& island = patches.islands[sizes.island[faces.piece[face]]];
                island.size = std::max(island.size, float(size));
                island.finest =
                    island.finest > 0 ? std::min(island.finest, float(size)) : float(size);
                if (!cutFace(uint32_t(i), int32_t(f), size)) ++degenerate;
                for (size_t p = firstParent; p < patches.parents.size(); ++p) {
                    Parent& parent = patches.parents[p];
                    parent.isSolid = shells[face] != Shell::OPEN &&
                                     !scene.materialOf(mesh, size_t(parent.face)).isTranslucent();
                    parent.isInward = shells[face] == Shell::INWARD;
                    parent.stopsDirect = scene.instances[i].stopsDirect;
                    parent.exchanges = scene.instances[i].exchanges;
                    parent.island = sizes.island[faces.piece[face]];
                    parent.surface = surface;
                }
            }
            patches.degenerateFaces += degenerate;
            if (degenerate)
                patches.warnings.push_back(
                    "object \"" + scene.instances[i].name + "\": " + std::to_string(degenerate) +
                    " faces without area, or with none but by rounding, were left out");
            if (doubles)
                patches.warnings.push_back(
                    "object \"" + scene.instances[i].name + "\": " + std::to_string(doubles) +
                    " faces lie on others that look the same way, whose light they get; merge such "
                    "faces (Merge by Distance), or remove the object if it lies on another");
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

    bool cutFace(uint32_t instance, int32_t face, double size) {
        const Mesh& mesh = scene.meshes[scene.instances[instance].mesh];
        const int32_t begin = mesh.faceOffsets[face], end = mesh.faceOffsets[face + 1];
        std::vector<int32_t> corners;
        for (int32_t c = begin; c < end; ++c) corners.push_back(c);
        if (scene.instances[instance].isMirrored()) std::reverse(corners.begin(), corners.end());
        std::vector<glm::dvec3> points;
        for (int32_t c : corners) points.push_back(patches.vertices[worldVertex(instance, c)]);

        if (corners.size() == 4 && isParallelogram(points)) {
            const uint32_t cell = addCell(instance, face, points[0], points[1], points[3],
                                          {corners[0], corners[1], corners[2], corners[3]});
            const glm::dvec3 normal = glm::cross(points[1] - points[0], points[3] - points[0]);
            Parent parent = makeParent({instance, face, cell, glm::vec3(glm::normalize(normal))},
                                       points[0], points[1], points[3]);
            for (int k = 0; k < 4; ++k) parent.vertex[k] = worldVertex(instance, corners[k]);
            parent.isTriangle = false;
            parent.countA = gridCount(glm::length(parent.a), size);
            parent.countB = gridCount(glm::length(parent.b), size);
            patches.parents.push_back(parent);
            return true;
        }
        bool any = false;
        for (const std::array<int, 3>& t : triangulate(points)) {
            const Triangle triangle{worldVertex(instance, corners[t[0]]),
                                    worldVertex(instance, corners[t[1]]),
                                    worldVertex(instance, corners[t[2]])};
            const double longest = std::max({glm::length(points[t[1]] - points[t[0]]),
                                             glm::length(points[t[2]] - points[t[1]]),
                                             glm::length(points[t[0]] - points[t[2]])});
            const uint32_t cell = addCell(instance, face, points[t[0]], points[t[1]], points[t[2]],
                                          {corners[t[0]], corners[t[1]], corners[t[2]], -1});
            if (isFlat(points[t[0]], points[t[1]], points[t[2]])) {
                patches.cells[cell].hasPatches = false;
                continue;
            }
            any = true;
            const glm::dvec3 normal =
                glm::cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
            cutTriangle({instance, face, cell, glm::vec3(glm::normalize(normal))}, triangle,
                        std::max(size, longest / kMaxGrid));
        }
        return any;
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

    uint32_t addCell(uint32_t instance, int32_t face, const glm::dvec3& p0, const glm::dvec3& pa,
                     const glm::dvec3& pb, const std::array<int32_t, 4>& corner) {
        Cell cell;
        cell.origin = glm::vec3(p0);
        cell.a = glm::vec3(pa - p0);
        cell.b = glm::vec3(pb - p0);
        cell.corner = corner;
        cell.instance = instance;
        cell.face = face;
        patches.cells.push_back(cell);
        return uint32_t(patches.cells.size()) - 1;
    }

    // What a parent is cut from.
    struct Origin {
        uint32_t instance;
        int32_t face;
        uint32_t cell;
        glm::vec3 normal;  // of the cell: that of a tiny piece would be rounding alone
    };

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

size_t numberPatches(Patches& patches) {
    size_t count = 0;
    for (Parent& parent : patches.parents) {
        parent.firstPatch = parent.firstTile = uint32_t(count);
        count += parent.patchCount();
    }
    return count;
}

// The grids were made for one patch size; makes them coarser by a factor.
void coarsen(Patches& patches, double factor) {
    for (Parent& parent : patches.parents) {
        parent.countA = uint16_t(std::max(1.0, std::floor(parent.countA / factor)));
        parent.countB = parent.isTriangle
                            ? parent.countA
                            : uint16_t(std::max(1.0, std::floor(parent.countB / factor)));
    }
}

// What patches have, after they were numbered.
void fillPatches(const Scene& scene, Patches& patches) {
    patches.parentOf.clear();
    patches.area.clear();
    for (size_t i = 0; i < patches.parents.size(); ++i) {
        const Parent& parent = patches.parents[i];
        patches.parentOf.resize(parent.firstPatch + parent.patchCount(), uint32_t(i));
        const float tileArea = parent.area() / float(parent.tileCount());
        for (uint32_t tile = 0; tile < parent.tileCount(); ++tile) {
            const uint32_t count = parent.firstOf(tile + 1) - parent.firstOf(tile);
            patches.area.resize(patches.area.size() + count, tileArea / float(count));
        }
    }
    patches.sheets = findSheets(patches);
    assignOpacity(scene, patches);
    assignMaterials(scene, patches);
}

}  // namespace

Patches subdivide(const Scene& scene, float patchSize, size_t maxPatches) {
    Patches patches;
    Placement placed(scene);
    if (placed.isEmpty()) return patches;
    placed.findIslands(patches);
    Subdivision(scene, placed, patches).cutFaces(patchSize);

    // Fit into maxPatches; a parent keeps at least one patch.
    while (numberPatches(patches) > std::max(maxPatches, patches.parents.size())) {
        coarsen(patches, 1.1);
        patches.size *= 1.1f;
        patches.finest *= 1.1f;
        for (Island& island : patches.islands) {
            island.size *= 1.1f;
            island.finest *= 1.1f;
        }
    }
    const size_t count = numberPatches(patches);
    if (count > kMostPatches)
        throw invalidArgument("the scene has too many faces: they are " + std::to_string(count) +
                              " patches at least, and " + std::to_string(kMostPatches) +
                              " are possible");
    for (Island& island : patches.islands)
        island.touchDistance =
            std::max(std::min(kTouchOfRadius * island.radius, kTouchOfPatch * island.finest),
                     kTouchOfDistance * (island.reach - island.radius));
    patches.tileCount = count;
    for (const Parent& parent : patches.parents) patches.totalArea += parent.area();
    fillPatches(scene, patches);
    return patches;
}

void cutTiles(const Scene& scene, Patches& patches, const std::vector<uint8_t>& levels) {
    uint32_t next = 0;
    for (Parent& parent : patches.parents) {
        parent.firstPatch = next;
        const auto begin = levels.begin() + ptrdiff_t(parent.firstTile);
        CutTiles cut{{begin, begin + parent.tileCount()}, {}};
        for (uint8_t level : cut.level) {
            cut.first.push_back(next - parent.firstPatch);
            next += 1u << (2 * level);
        }
        cut.first.push_back(next - parent.firstPatch);
        const bool isCut = next - parent.firstPatch > parent.tileCount();
        parent.cut = isCut ? std::make_shared<const CutTiles>(std::move(cut)) : nullptr;
    }
    fillPatches(scene, patches);
}

}  // namespace raybundle
