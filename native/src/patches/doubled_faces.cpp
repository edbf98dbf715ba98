// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/doubled_faces.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>

#include "patches/plane.h"

namespace raybundle {
namespace {

// Vertices coincide if rounding separates them: by at most kOfObject times the extent of their
// object and the rounding of their coordinates, and at most kOfFace times the extent of their face.
constexpr double kOfObject = 2e-6, kOfFace = 1e-3;
// Faces are sorted along this unit vector. It is oblique to the axes, because many faces of a
// regular mesh would have the same position along a row.
constexpr glm::dvec3 kAcrossAll{0.534522483824849, 0.612372435695794, 0.582475449195318};

class Search {
  public:
    Search(const Scene& scene, const WeldedFaces& faces, const std::vector<size_t>& firstVertex,
           const std::vector<glm::vec3>& places)
        : scene(scene), faces(faces), places(places) {
        for (size_t i = 0; i < scene.instances.size(); ++i) {
            glm::dvec3 low(INFINITY), high(-INFINITY);
            const size_t count = meshOf(uint32_t(i)).vertices.size();
            for (size_t v = 0; v < count; ++v) {
                low = glm::min(low, glm::dvec3(places[firstVertex[i] + v]));
                high = glm::max(high, glm::dvec3(places[firstVertex[i] + v]));
            }
            extents.push_back(count > 0 ? glm::distance(low, high) : 0.0);
        }
    }

    DoubledFaces find() const {
        struct Place {
            double along;
            uint32_t face;
        };
        std::vector<Place> sorted;
        for (size_t f = 0; f < faces.count(); ++f)
            sorted.push_back({glm::dot(centre(f), kAcrossAll), uint32_t(f)});
        tbb::parallel_sort(sorted.begin(), sorted.end(), [](const Place& a, const Place& b) {
            return a.along != b.along ? a.along < b.along : a.face < b.face;
        });
        DoubledFaces result;
        result.isDouble.assign(faces.count(), false);
        for (size_t i = 0; i < sorted.size(); ++i) {
            const double rounding = roundingOf(sorted[i].face);
            for (size_t k = i + 1;
                 k < sorted.size() && sorted[k].along - sorted[i].along <= rounding; ++k) {
                // The face with a result stands for both, or else the one with the smaller index.
                size_t first = sorted[i].face, other = sorted[k].face;
                if (result.isDouble[first]) break;
                if (result.isDouble[other]) continue;
                if (rankOf(other) < rankOf(first)) std::swap(first, other);
                addIfDouble(first, other, rounding, result);
            }
        }
        return result;
    }

  private:
    const Mesh& meshOf(uint32_t instance) const {
        return scene.meshes[size_t(scene.instances[instance].mesh)];
    }
    size_t faceOfMesh(size_t face) const { return face - faces.firstFace[faces.instance[face]]; }
    size_t size(size_t face) const { return faces.offsets[face + 1] - faces.offsets[face]; }
    glm::dvec3 place(size_t face, size_t k) const {
        return places[faces.vertices[faces.offsets[face] + k]];
    }
    glm::dvec3 centre(size_t face) const {
        glm::dvec3 sum(0.0);
        for (size_t k = 0; k < size(face); ++k) sum += place(face, k);
        return sum / double(size(face));
    }
    std::pair<bool, size_t> rankOf(size_t face) const {
        return {!scene.instances[faces.instance[face]].hasResultOnFace(faceOfMesh(face)), face};
    }
    // Returns the distance up to which rounding separates vertices of a face, m.
    double roundingOf(size_t face) const {
        double most = 0, extent = 0;
        for (size_t k = 0; k < size(face); ++k) {
            const glm::dvec3 at = place(face, k);
            most = std::max({most, std::abs(at.x), std::abs(at.y), std::abs(at.z)});
            extent = std::max(extent, glm::distance(at, place(face, 0)));
        }
        return std::min(kOfObject * extents[faces.instance[face]] + Plane::kOfCoordinates * most,
                        kOfFace * extent);
    }
    // Returns the corner of the mesh that is corner k of the face here. Mirrored instances have
    // their corners in reverse order.
    uint32_t corner(size_t face, size_t k) const {
        const uint32_t instance = faces.instance[face];
        const size_t n = size(face);
        return uint32_t(meshOf(instance).faceOffsets[faceOfMesh(face)]) +
               uint32_t(scene.instances[instance].isMirrored() ? n - 1 - k : k);
    }
    int32_t materialIndex(size_t face) const {
        return meshOf(faces.instance[face]).faceMaterials[faceOfMesh(face)];
    }
    const Material& materialOf(size_t face) const {
        return scene.materialOf(meshOf(faces.instance[face]), faceOfMesh(face));
    }
    // Returns whether two faces act alike on light, so that one may stand for both.
    bool doAlike(size_t first, size_t other) const {
        const Instance& a = scene.instances[faces.instance[first]];
        const Instance& b = scene.instances[faces.instance[other]];
        const bool bothBaked = a.role == RB_ROLE_BAKE && b.role == RB_ROLE_BAKE;
        if (a.stopsDirect != b.stopsDirect || a.exchanges != b.exchanges ||
            (bothBaked && a.side != b.side))
            return false;
        const Material &m = materialOf(first), &n = materialOf(other);
        if (!m.isOpaque() || !n.isOpaque()) return false;
        return materialIndex(first) == materialIndex(other) ? !m.emits() || a.lightSet == b.lightSet
                                                            : !m.emits() && !n.emits();
    }
    // Adds `other` as a double of `first` if their vertices coincide, in the same order around.
    void addIfDouble(size_t first, size_t other, double rounding, DoubledFaces& result) const {
        const size_t n = size(first);
        if (n != size(other)) return;
        size_t turn = 0;
        while (turn < n && glm::distance(place(first, turn), place(other, 0)) > rounding) ++turn;
        for (size_t k = 0; k < n && turn < n; ++k)
            if (glm::distance(place(first, (turn + k) % n), place(other, k)) > rounding) return;
        if (turn == n) return;
        result.anyCoincide = true;
        if (!doAlike(first, other)) return;
        result.isDouble[other] = true;
        for (size_t k = 0; k < n; ++k)
            result.corners.push_back({faces.instance[other], corner(other, k),
                                      faces.instance[first], corner(first, (turn + k) % n)});
    }

    const Scene& scene;
    const WeldedFaces& faces;
    const std::vector<glm::vec3>& places;
    std::vector<double> extents;  // per instance, metres
};

}  // namespace

DoubledFaces findDoubledFaces(const Scene& scene, const WeldedFaces& faces,
                              const std::vector<size_t>& firstVertex,
                              const std::vector<glm::vec3>& places) {
    return Search(scene, faces, firstVertex, places).find();
}

}  // namespace raybundle
