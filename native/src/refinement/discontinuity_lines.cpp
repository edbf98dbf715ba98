// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/discontinuity_lines.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "job/cancellation.h"
#include "refinement/jump_search.h"
#include "refinement/line_points.h"
#include "refinement/source_light.h"
#include "scene/disjoint_sets.h"

namespace raybundle {
namespace {

// Smallest jump, in errors that the scene may have on average, and in the RMS light of the scene.
// The light in which jumps are searched may have the share kNoise of it as error.
constexpr float kLeastJump = 2, kFaint = 0.1f, kNoise = 0.25f;
// Triangles whose mean square error is below this share of that which is allowed on average have
// no line, unless one comes from beside them.
constexpr double kLeastError = 0.25;
// Accuracy of a line, and the length below which it is left out, in lengths of the edges that it
// crosses.
constexpr double kAccuracy = 1.0 / 16, kShortest = 3;
// Accuracy of a line in widths of what covers it, or of its own if it is soft.
constexpr double kOfWidth = 0.25;
// An end is prolonged by at most kReach lengths of the edges that its line crosses, in steps of the
// share kStep of an edge, as long as the light jumps between points at a share kAside of an edge on
// both sides.
constexpr double kReach = 3, kStep = 0.25, kAside = 0.125;
// An end that has come close to a surface which covers the face is prolonged to it, over at most
// kToCover times kAside. The border of the surface is found by kCoverHalvings halvings.
constexpr double kToCover = 4;
constexpr int kCoverHalvings = 6;
// Number of parts of the gap between the ends of a line, between which points are tested.
constexpr int kBetween = 16;

// An open end of a line that is prolonged.
struct OpenEnd {
    size_t line;
    bool isLast;
    glm::dvec3 at, along, across;     // the end, m, and unit vectors on the face
    double edge;                      // m
    double good = 0, bad = INFINITY;  // shares of an edge up to which the light jumps, or not

    double next() const { return bad < INFINITY ? 0.5 * (good + bad) : good + kStep; }
    glm::dvec3 place(double reach, double aside) const {
        return at + edge * (reach * along + aside * across);
    }
};

class LineSearch {
  public:
    LineSearch(const KnownLight& known, const AdaptedMesh& adapted, const Progress& progress,
               Report& report)
        : adapted(adapted),
          mesh(adapted.mesh()),
          leastShare(std::max(kFaint, kLeastJump * known.settings.targetError)),
          leastJump(double(leastShare / known.settings.targetError) *
                    std::sqrt(adapted.allowedSquare())),
          light(known, adapted.faceLight(), kNoise * leastShare, progress, report),
          jumps(mesh, light, leastJump) {}

    std::vector<DiscontinuityLine> lines() {
        jumps.search(brokenTriangles());
        const std::vector<PointLine> lines = longLines(joinEnds(crossedLines()));
        std::vector<std::vector<glm::dvec3>> corners;
        for (const PointLine& line : lines) corners.push_back(cornersOf(line));
        prolong(lines, corners);
        close(lines, corners);
        std::vector<DiscontinuityLine> result;
        for (size_t k = 0; k < lines.size(); ++k)
            result.push_back({{lines[k].face, corners[k], kAccuracy * lines[k].meanEdge()},
                              lines[k].jump,
                              lines[k].width()});
        return result;
    }

  private:
    // Returns the triangles whose light is far from linear.
    std::vector<uint32_t> brokenTriangles() const {
        std::vector<uint32_t> result;
        for (uint32_t t = 0; t < mesh.triangles().size(); ++t)
            if (mesh.triangles()[t].isAlive &&
                adapted.meanSquareError(t) > kLeastError * adapted.allowedSquare())
                result.push_back(t);
        return result;
    }

    // Returns the lines that pass from edge to edge through the triangles.
    std::vector<PointLine> crossedLines() {
        // Per face and edge: the edges with which it shares a triangle in which the line continues.
        using Crossing = std::pair<int32_t, uint32_t>;
        std::map<Crossing, std::vector<uint32_t>> next;
        for (uint32_t t = 0; t < mesh.triangles().size(); ++t) {
            if (!jumps.isSearched(t)) continue;
            std::vector<uint32_t> met;
            for (uint32_t k = 0; k < 3; ++k)
                if (const uint32_t e = jumps.indexOf(t, k); jumps.edge(e).jumps) met.push_back(e);
            // A line that meets all three edges passes close to a corner.
            if (met.size() == 3) met.erase(met.begin() + std::ptrdiff_t(middleOf(met)));
            if (met.size() != 2) continue;
            const int32_t face = mesh.triangles()[t].face;
            next[{face, met[0]}].push_back(met[1]);
            next[{face, met[1]}].push_back(met[0]);
        }
        std::vector<PointLine> result;
        auto follow = [&](const Crossing& start) {
            PointLine line{start.first};
            line.isOpen[0] = !jumps.edge(start.second).isOfSource;
            line.edge[0] = start.second;
            for (uint32_t at = start.second;;) {
                const JumpEdge& edge = jumps.edge(at);
                const double widest = std::max(edge.coveredWidth(), edge.width);
                line.points.push_back({edge.crossing(), edge.length(),
                                       std::max(kAccuracy, kOfWidth * widest) * edge.length(),
                                       edge.width * (edge.to - edge.from)});
                line.isOpen[1] = !edge.isOfSource;
                line.edge[1] = at;
                line.jump = std::max(line.jump, edge.difference());
                std::vector<uint32_t>& onward = next[{start.first, at}];
                if (onward.empty()) break;
                const uint32_t to = onward.back();
                onward.pop_back();
                std::vector<uint32_t>& back = next[{start.first, to}];
                back.erase(std::find(back.begin(), back.end(), at));
                at = to;
            }
            result.push_back(std::move(line));
        };
        std::vector<Crossing> starts;
        for (const bool isEnd : {true, false})
            for (const auto& [crossing, onward] : next)
                if ((onward.size() == 1) == isEnd) starts.push_back(crossing);
        for (const Crossing& start : starts)
            if (!next[start].empty()) follow(start);
        return result;
    }

    // Returns the number of the edge, of three that a line meets, whose point lies between those of
    // the others.
    size_t middleOf(const std::vector<uint32_t>& met) const {
        auto gap = [&](size_t k) {  // between the points of the others
            return glm::distance(jumps.edge(met[(k + 1) % 3]).crossing(),
                                 jumps.edge(met[(k + 2) % 3]).crossing());
        };
        size_t widest = 0;
        for (size_t k = 1; k < 3; ++k)
            if (gap(k) > gap(widest)) widest = k;
        return widest;
    }

    // Returns the lines that are long, together with those in which they go on in other faces.
    static std::vector<PointLine> longLines(const std::vector<PointLine>& lines) {
        DisjointSets joined(lines.size());
        std::map<uint32_t, uint32_t> atEdge;  // the first line that ends on an edge of the source
        for (uint32_t k = 0; k < lines.size(); ++k)
            for (const bool isLast : {false, true})
                if (!lines[k].isOpen[isLast])
                    joined.join(k, atEdge.try_emplace(lines[k].edge[isLast], k).first->second);
        std::vector<double> lengths(lines.size(), 0.0);  // in lengths of the edges that are crossed
        for (uint32_t k = 0; k < lines.size(); ++k)
            lengths[joined.root(k)] += lines[k].length() / lines[k].meanEdge();
        std::vector<PointLine> result;
        for (uint32_t k = 0; k < lines.size(); ++k)
            if (lengths[joined.root(k)] >= kShortest) result.push_back(lines[k]);
        return result;
    }

    // Prolongs open ends of lines straight on, as far as the light jumps: up to the surface that
    // casts the shadow, close to which points have no light of their own.
    void prolong(const std::vector<PointLine>& lines,
                 std::vector<std::vector<glm::dvec3>>& corners) {
        std::vector<OpenEnd> ends = openEnds(lines, corners);
        for (int step = 0; step < int(kReach / kStep); ++step) {
            std::vector<FacePlace> places;
            for (const OpenEnd& end : ends)
                for (const double side : {-kAside, kAside})
                    places.push_back({lines[end.line].face, end.place(end.next(), side),
                                      uint32_t(places.size())});
            const auto found = light.at(places);
            for (size_t k = 0; k < ends.size(); ++k) {
                const size_t one = 2 * k, other = 2 * k + 1;
                const bool jumpsThere =
                    isOn(places[one]) && isOn(places[other]) && found[one] && found[other] &&
                    double(glm::distance(*found[one], *found[other])) > leastJump;
                (jumpsThere ? ends[k].good : ends[k].bad) = ends[k].next();
            }
        }
        for (const OpenEnd& end : ends)
            (end.isLast ? corners[end.line].back() : corners[end.line].front()) =
                coverBeyond(lines[end.line].face, end);
    }

    std::vector<OpenEnd> openEnds(const std::vector<PointLine>& lines,
                                  const std::vector<std::vector<glm::dvec3>>& corners) const {
        std::vector<OpenEnd> ends;
        for (size_t k = 0; k < lines.size(); ++k) {
            const std::vector<glm::dvec3>& of = corners[k];
            const auto normal = adapted.faceLight().normal(lines[k].face);
            for (const bool isLast : {false, true}) {
                if (!lines[k].isOpen[isLast] || of.size() < 2 || !normal) continue;
                const glm::dvec3 at = isLast ? of.back() : of.front();
                const glm::dvec3 along = at - (isLast ? of[of.size() - 2] : of[1]);
                const glm::dvec3 across = glm::cross(along, *normal);
                if (!(glm::length(across) > 0)) continue;
                ends.push_back({k, isLast, at, glm::normalize(along), glm::normalize(across),
                                lines[k].end(isLast).edge});
            }
        }
        return ends;
    }

    // Returns the point up to which an end is prolonged: in the surface that covers the face, if
    // the line meets one nearby or passes it as closely as it is accurate.
    glm::dvec3 coverBeyond(int32_t face, const OpenEnd& end) const {
        auto isCovered = [&](double reach, double aside) {
            return isCoveredAt({face, end.place(reach, aside), 0});
        };
        for (double step = 0; step < kToCover; ++step)
            for (const double aside : {0.0, kAccuracy, -kAccuracy}) {
                double low = end.good + step * kAside, high = low + kAside;
                if (!isCovered(high, aside)) continue;
                for (int k = 0; k < kCoverHalvings; ++k) {
                    const double middle = 0.5 * (low + high);
                    (isCovered(middle, aside) ? high : low) = middle;
                }
                return end.place(high, aside);
            }
        return end.place(end.good, 0);
    }

    // Closes lines, each of whose ends lies beside a surface that covers the face between the ends:
    // the light jumps between one side of that surface and the other.
    void close(const std::vector<PointLine>& lines,
               std::vector<std::vector<glm::dvec3>>& corners) const {
        for (size_t k = 0; k < lines.size(); ++k) {
            if (!lines[k].isOpen[0] || !lines[k].isOpen[1]) continue;
            const glm::dvec3 first = corners[k].front(), last = corners[k].back();
            bool isCovered = true;
            for (int step = 1; step < kBetween && isCovered; ++step)
                isCovered =
                    isCoveredAt({lines[k].face, glm::mix(first, last, double(step) / kBetween), 0});
            if (isCovered) corners[k].push_back(first);
        }
    }

    bool isOn(const FacePlace& place) const {
        return adapted.faceLight().isOn(place.face, place.at);
    }
    bool isCoveredAt(const FacePlace& place) const { return isOn(place) && light.isCovered(place); }

    const AdaptedMesh& adapted;
    const RefinedMesh& mesh;
    const float leastShare;  // smallest jump, in the RMS light of the scene
    const double leastJump;  // W/m^2
    SourceSampler light;
    JumpSearch jumps;
};

}  // namespace

std::vector<DiscontinuityLine> discontinuityLines(const KnownLight& known,
                                                  const AdaptedMesh& adapted,
                                                  const Progress& progress, Report& report) {
    return LineSearch(known, adapted, progress, report).lines();
}

}  // namespace raybundle
