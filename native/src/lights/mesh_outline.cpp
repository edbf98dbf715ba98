// SPDX-License-Identifier: GPL-3.0-or-later
#include "lights/mesh_outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>

namespace raybundle {
namespace {

// Consecutive edges that turn by less than this angle form one edge, radians.
constexpr double kStraight = 1e-5;
// Faces of one facet deviate from its plane by at most this share of the plane's thickness. A point
// in front of the plane is then in front of all these faces.
constexpr double kFlatOutline = 0.25;
// Meshes of more parents get no outline.
constexpr size_t kMostParents = 1 << 17;

// Returns the term of an edge in Lambert's sum: the angle that the edge spans times the cosine of
// the angle between its normal and the receiver's. `a` and `b` are relative to the receiver.
double edgeTerm(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& normal) {
    const glm::dvec3 c = glm::cross(a, b);
    const double length = glm::length(c);
    if (length <= 0) return 0;
    // In float the angle keeps its relative precision, which is all that the sum needs.
    return double(std::atan2(float(length), float(glm::dot(a, b)))) * glm::dot(c, normal) / length;
}

// Finds the facets of a mesh and the edges between them.
class Facets {
  public:
    Facets(const Patches& patches, const std::vector<uint32_t>& parents, bool ofBacks,
           double extent)
        : patches(patches),
          parents(parents),
          turn(ofBacks ? -1 : 1),
          extent(extent),
          facetOf(parents.size(), kNone) {
        weld();
        for (uint32_t k = 0; k < parents.size(); ++k)
            if (facetOf[k] == kNone) grow(k);
    }

    // `from` and `to` are indices into `places`. `along` and `against` are facets, or kNone.
    struct Edge {
        uint32_t from, to, along, against;
    };

    // Returns the edges between different facets. Edges in a line are joined.
    std::vector<Edge> edges() const {
        std::vector<Edge> all;
        for (const auto& [ends, users] : usersOf) {
            std::vector<uint32_t> along, against;
            for (const User& user : users)
                (user.isAlong ? along : against).push_back(facetOf[user.parent]);
            for (size_t k = 0; k < std::max(along.size(), against.size()); ++k) {
                const Edge edge{ends.first, ends.second, k < along.size() ? along[k] : kNone,
                                k < against.size() ? against[k] : kNone};
                if (edge.along != edge.against) all.push_back(edge);
            }
        }
        return straightened(all);
    }

    static constexpr uint32_t kNone = ~0u;
    std::vector<Plane> planes;      // one per facet
    std::vector<glm::vec3> places;  // positions of the vertices, each once

  private:
    using Ends = std::pair<uint32_t, uint32_t>;  // the smaller index first
    struct User {
        uint32_t parent;  // index into `parents`
        bool isAlong;  // whether the parent traverses the edge from the smaller index to the larger
    };

    // Joins vertices in the same place, such as those of split edges.
    void weld() {
        std::map<std::array<float, 3>, uint32_t> known;
        cornersOf.resize(parents.size());
        for (uint32_t k = 0; k < parents.size(); ++k) {
            const Parent& parent = patches.parents[parents[k]];
            const size_t count = parent.isTriangle ? 3 : 4;
            for (size_t c = 0; c < count; ++c) {
                const glm::vec3& at = patches.vertices[parent.vertex[c]];
                const auto [found, isNew] =
                    known.try_emplace({at.x, at.y, at.z}, uint32_t(places.size()));
                if (isNew) places.push_back(at);
                cornersOf[k].push_back(found->second);
            }
            for (size_t c = 0; c < count; ++c) {
                const uint32_t a = cornersOf[k][c], b = cornersOf[k][(c + 1) % count];
                if (a != b) usersOf[std::minmax(a, b)].push_back({k, (a < b) == (turn > 0)});
            }
        }
    }

    // Grows a facet from a parent across shared edges, to all parents that lie in the plane of the
    // first.
    void grow(uint32_t seed) {
        const Parent& first = patches.parents[parents[seed]];
        const Plane plane(first.origin, first.a, first.b,
                          turn * glm::normalize(glm::dvec3(first.normal)), extent);
        const uint32_t facet = uint32_t(planes.size());
        planes.push_back(plane);
        std::vector<uint32_t> open{seed};
        facetOf[seed] = facet;
        while (!open.empty()) {
            const uint32_t k = open.back();
            open.pop_back();
            for (size_t c = 0; c < cornersOf[k].size(); ++c) {
                const Ends ends =
                    std::minmax(cornersOf[k][c], cornersOf[k][(c + 1) % cornersOf[k].size()]);
                const auto users = usersOf.find(ends);
                if (users == usersOf.end() || users->second.size() != 2) continue;
                for (const User& user : users->second)
                    if (facetOf[user.parent] == kNone && liesIn(plane, user.parent)) {
                        facetOf[user.parent] = facet;
                        open.push_back(user.parent);
                    }
            }
        }
    }

    bool liesIn(const Plane& plane, uint32_t k) const {
        const Parent& parent = patches.parents[parents[k]];
        return turn * glm::dot(glm::dvec3(parent.normal), plane.normal) > 0 &&
               std::all_of(cornersOf[k].begin(), cornersOf[k].end(), [&](uint32_t vertex) {
                   return std::abs(plane.height(places[vertex])) <=
                          kFlatOutline * plane.halfThickness(places[vertex]);
               });
    }

    // Joins consecutive edges that lie in a line and separate the same two facets.
    std::vector<Edge> straightened(const std::vector<Edge>& all) const {
        // Turn each edge so that `along` is the smaller facet. All edges of a chain then have one
        // direction.
        std::vector<Edge> turned = all;
        for (Edge& edge : turned)
            if (edge.along > edge.against) {
                std::swap(edge.along, edge.against);
                std::swap(edge.from, edge.to);
            }
        // For each vertex and pair of facets: the edges that arrive and those that leave.
        using Key = std::tuple<uint32_t, uint32_t, uint32_t>;
        struct Meeting {
            uint32_t edge = 0;
            int count = 0;
        };
        std::map<Key, Meeting> before, after;
        for (uint32_t e = 0; e < turned.size(); ++e) {
            const Edge& edge = turned[e];
            for (auto& [at, vertex] : {std::pair(&after, edge.from), std::pair(&before, edge.to)}) {
                Meeting& meeting = (*at)[{vertex, edge.along, edge.against}];
                meeting.edge = e;
                ++meeting.count;
            }
        }
        auto at = [&](uint32_t vertex) { return glm::dvec3(places[vertex]); };
        auto single = [](const std::map<Key, Meeting>& map,
                         const Key& key) -> std::optional<uint32_t> {
            const auto found = map.find(key);
            if (found == map.end() || found->second.count != 1) return std::nullopt;
            return found->second.edge;
        };
        auto next = [&](const Edge& edge) -> std::optional<uint32_t> {
            const Key key{edge.to, edge.along, edge.against};
            const auto in = single(before, key), out = single(after, key);
            if (!in || !out) return std::nullopt;
            const glm::dvec3 u = at(edge.to) - at(edge.from),
                             v = at(turned[*out].to) - at(turned[*out].from);
            const bool isStraight =
                glm::dot(u, v) > 0 &&
                glm::length(glm::cross(u, v)) <= kStraight * glm::length(u) * glm::length(v);
            return isStraight ? out : std::nullopt;
        };
        std::vector<bool> goesOn(turned.size(), false);  // whether the edge continues another edge
        for (const Edge& edge : turned)
            if (const auto out = next(edge)) goesOn[*out] = true;
        std::vector<Edge> lines;
        size_t used = 0;
        for (uint32_t e = 0; e < turned.size(); ++e) {
            if (goesOn[e]) continue;
            Edge line = turned[e];
            ++used;
            for (auto out = next(turned[e]); out; out = next(turned[*out]), ++used)
                line.to = turned[*out].to;
            lines.push_back(line);
        }
        // A closed loop of very short edges has no first edge. The edges then remain as they are.
        return used == turned.size() ? lines : all;
    }

    const Patches& patches;
    const std::vector<uint32_t>& parents;
    // -1: the backs emit, whose outlines are traversed in the opposite direction.
    const double turn;
    const double extent;            // metres
    std::vector<uint32_t> facetOf;  // per index into `parents`
    // Per index into `parents`: indices into `places`.
    std::vector<std::vector<uint32_t>> cornersOf;
    std::map<Ends, std::vector<User>> usersOf;
};

}  // namespace

double polygonIrradiance(const glm::dvec3& point, const glm::dvec3& normal,
                         const glm::dvec3* polygon, int count) {
    // Clip at the horizon of the receiver.
    std::array<glm::dvec3, 8> clipped;
    int n = 0;
    for (int k = 0; k < count; ++k) {
        const glm::dvec3 a = polygon[k] - point, b = polygon[(k + 1) % count] - point;
        const double ha = glm::dot(a, normal), hb = glm::dot(b, normal);
        if (ha > 0) clipped[n++] = a;
        if ((ha > 0) != (hb > 0)) clipped[n++] = a + (ha / (ha - hb)) * (b - a);
    }
    double sum = 0;
    for (int k = 0; k < n; ++k) {
        const glm::dvec3 a = clipped[k], b = clipped[(k + 1) % n];
        sum += edgeTerm(a, b, normal);
    }
    return 0.5 * std::abs(sum);
}

MeshOutline::MeshOutline(const Patches& patches, const std::vector<uint32_t>& parents, bool ofBacks,
                         double extent) {
    if (parents.empty() || parents.size() > kMostParents) return;
    const Facets made(patches, parents, ofBacks, extent);
    if (made.planes.size() > kMostFacets) return;
    facets = made.planes;
    glm::dvec3 low(INFINITY), high(-INFINITY);
    for (const glm::vec3& place : made.places) {
        low = glm::min(low, glm::dvec3(place));
        high = glm::max(high, glm::dvec3(place));
    }
    centre = 0.5 * (low + high);
    radius = 0.5 * glm::length(high - low);
    const uint32_t none = uint32_t(facets.size());
    for (const Facets::Edge& edge : made.edges())
        edges.push_back({made.places[edge.from], made.places[edge.to], std::min(edge.along, none),
                         std::min(edge.against, none)});
    if (edges.size() > kMostEdges) edges.clear();
}

// Per facet: whether it is turned towards the point (one more entry for "no facet"), and the first
// place where the horizon cuts the facet. The angles of further cuts are measured from this place.
struct MeshOutline::Facing {
    std::array<bool, kMostFacets + 1> looks;
    std::array<bool, kMostFacets> isCut;
    std::array<glm::dvec3, kMostFacets> firstCut;

    // Returns how often the outlines of all facets turned towards the point traverse an edge: the
    // number of times along it less the number of times against it.
    int countOf(const Edge& edge) const { return looks[edge.along] - looks[edge.against]; }
};

double MeshOutline::irradiance(const glm::dvec3& point, const glm::dvec3& normal) const {
    const double middle = glm::dot(centre - point, normal);
    if (middle < -radius) return 0;
    Facing facing;
    bool any = false;
    for (size_t f = 0; f < facets.size(); ++f) {
        facing.looks[f] = facets[f].side(point) == PlaneSide::FRONT;
        facing.isCut[f] = false;
        any |= facing.looks[f];
    }
    if (!any) return 0;
    facing.looks[facets.size()] = false;
    const bool isClipped = middle < radius;
    double sum = 0;
    for (const Edge& edge : edges) {
        if (isClipped)
            sum += clippedTerm(edge, facing, point, normal);
        else if (const int count = facing.countOf(edge))
            sum += count * edgeTerm(edge.from - point, edge.to - point, normal);
    }
    // An outline that is counter-clockwise about the facet's own normal is clockwise about the
    // receiver's.
    return std::max(0.0, -0.5 * sum);
}

// Where the receiver's horizon cuts a facet, the cuts close the facet's outline along the line in
// which the horizon meets the facet's plane, from points where edges go below the horizon to points
// where edges come up. It does not matter which of these points are paired. All cuts of a facet lie
// within half a turn, since the receiver is not in the facet's plane.
double MeshOutline::clippedTerm(const Edge& edge, Facing& facing, const glm::dvec3& point,
                                const glm::dvec3& normal) const {
    if (!facing.looks[edge.along] && !facing.looks[edge.against]) return 0;
    const glm::dvec3 a = edge.from - point, b = edge.to - point;
    const double ha = glm::dot(a, normal), hb = glm::dot(b, normal);
    if (ha <= 0 && hb <= 0) return 0;
    const int count = facing.countOf(edge);
    if (ha > 0 && hb > 0) return count == 0 ? 0 : count * edgeTerm(a, b, normal);
    const glm::dvec3 cut = a + (ha / (ha - hb)) * (b - a);
    double sum =
        count == 0 ? 0 : count * (ha > 0 ? edgeTerm(a, cut, normal) : edgeTerm(cut, b, normal));
    const double up = ha > 0 ? -1 : 1;
    for (const auto& [facet, way] : {std::pair(edge.along, 1.0), std::pair(edge.against, -1.0)}) {
        if (!facing.looks[facet]) continue;
        if (!facing.isCut[facet]) {
            facing.isCut[facet] = true;
            facing.firstCut[facet] = cut;
            continue;
        }
        const glm::dvec3& first = facing.firstCut[facet];
        sum += way * up *
               double(std::atan2(float(glm::dot(cut, glm::cross(normal, first))),
                                 float(glm::dot(cut, first))));
    }
    return sum;
}

}  // namespace raybundle
