// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/line_points.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "job/cancellation.h"
#include "patches/segment.h"

namespace raybundle {
namespace {

// Ends of lines are joined over a gap of at most kGap lengths of the edges that they cross. A gap
// of less than kNarrowLength lengths has no direction.
constexpr double kGap = 2, kNarrowLength = 0.5;
// The two ends of one line are joined if it has at least so many points.
constexpr size_t kRing = 5;
// The cosine of the angle between two lines beyond which they arrive beside each other, and the
// cosine of a turn beyond which a line turns back.
constexpr double kBeside = 0.7, kBack = -0.9;
// The sine of the angle below which two straight lines count as parallel.
constexpr double kParallel = 0.05;
// Number of points of the line that the short side of a corner may have, and that the long ones
// must have.
constexpr size_t kShortSide = 6, kLongSide = 3;
// Number of points over which a corner is moved.
constexpr size_t kMove = 3;
constexpr size_t kNoEnd = SIZE_MAX;

// Returns the point between two others that is farthest from the straight line between these, in
// units of its accuracy; `first` if all are as near as they are accurate.
size_t farthestBetween(const std::vector<LinePoint>& points, size_t first, size_t last) {
    size_t farthest = first;
    double most = 1;
    for (size_t k = first + 1; k < last; ++k) {
        const double off =
            distanceToSegment(points[k].at, points[first].at, points[last].at) / points[k].accuracy;
        if (off > most) {
            farthest = k;
            most = off;
        }
    }
    return farthest;
}

// Returns the sum of the squared distances of the points between two others from the straight line
// between these, in units of their accuracy.
double squaresBetween(const std::vector<LinePoint>& points, size_t first, size_t last) {
    double sum = 0;
    for (size_t k = first + 1; k < last; ++k)
        sum += std::pow(
            distanceToSegment(points[k].at, points[first].at, points[last].at) / points[k].accuracy,
            2);
    return sum;
}

// Moves needed points to points beside them if the polygon is then nearer to all others.
void moveToCorners(const std::vector<LinePoint>& points, std::vector<size_t>& needed) {
    for (size_t k = 1; k + 1 < needed.size(); ++k) {
        const size_t before = needed[k - 1], after = needed[k + 1];
        const size_t first = std::max(before + 1, needed[k] - std::min(needed[k], kMove));
        size_t best = needed[k];
        double least = INFINITY;
        for (size_t at = first; at <= needed[k] + kMove && at < after; ++at) {
            const double squares =
                squaresBetween(points, before, at) + squaresBetween(points, at, after);
            if (squares < least) {
                best = at;
                least = squares;
            }
        }
        needed[k] = best;
    }
}

// Returns the indices of the points that a polygon through few of them needs, so that all others
// are as near to it as they are accurate. Source: Douglas and Peucker, "Algorithms for the
// Reduction of the Number of Points Required to Represent a Digitized Line or its Caricature"
// (1973). Differs: points are then moved to where the line has its corners, and those that this has
// made superfluous are removed.
std::vector<size_t> neededPoints(const std::vector<LinePoint>& points) {
    std::vector<size_t> needed{0};
    std::vector<std::pair<size_t, size_t>> open{{0, points.size() - 1}};
    while (!open.empty()) {
        const auto [first, last] = open.back();
        open.pop_back();
        const size_t farthest = farthestBetween(points, first, last);
        if (farthest == first) {
            needed.push_back(last);
        } else {
            open.push_back({farthest, last});
            open.push_back({first, farthest});
        }
    }
    moveToCorners(points, needed);
    for (size_t k = 1; k + 1 < needed.size();) {
        if (farthestBetween(points, needed[k - 1], needed[k + 1]) == needed[k - 1])
            needed.erase(needed.begin() + std::ptrdiff_t(k));
        else
            ++k;
    }
    return needed;
}

// A straight line in space.
struct Straight {
    glm::dvec3 at;     // a point of it, m
    glm::dvec3 along;  // unit vector

    glm::dvec3 nearest(const glm::dvec3& point) const {
        return at + glm::dot(point - at, along) * along;
    }
};

// Returns the straight line that is nearest to points, those from `first` to `last`. Those at its
// ends count only if there are few: beside a corner, they may belong to the next line. Empty if the
// points are in one place.
std::optional<Straight> nearestLine(const std::vector<LinePoint>& points, size_t first,
                                    size_t last) {
    if (last - first > 2 * kLongSide) {
        ++first;
        --last;
    }
    const glm::dvec3 chord = points[last].at - points[first].at;
    glm::dvec3 middle(0.0), along(0.0);
    for (size_t k = first; k <= last; ++k) middle += points[k].at / double(last - first + 1);
    // A step towards the longest axis of the points.
    for (size_t k = first; k <= last; ++k)
        along += glm::dot(points[k].at - middle, chord) * (points[k].at - middle);
    const double length = glm::length(along);
    if (!(length > 0)) return {};
    return Straight{middle, along / length};
}

// Returns the point at which two straight lines in a plane meet. Empty if they are nearly parallel.
std::optional<glm::dvec3> meeting(const Straight& one, const Straight& two) {
    const glm::dvec3 normal = glm::cross(one.along, two.along);
    const double square = glm::dot(normal, normal);
    if (!(square > kParallel * kParallel)) return {};
    return one.at + glm::dot(glm::cross(two.at - one.at, two.along), normal) / square * one.along;
}

// Returns whether each point between two others lies on one of two straight lines.
bool areOn(const std::vector<LinePoint>& points, size_t first, size_t last, const Straight& one,
           const Straight& two) {
    for (size_t k = first + 1; k < last; ++k) {
        const glm::dvec3& at = points[k].at;
        if (std::min(glm::distance(at, one.nearest(at)), glm::distance(at, two.nearest(at))) >
            points[k].accuracy)
            return false;
    }
    return true;
}

// Removes corners on straight lines, and those at which a line turns back.
void removeFlat(std::vector<LinePoint>& corners) {
    for (size_t k = 1; k + 1 < corners.size();) {
        const glm::dvec3 &last = corners[k - 1].at, &at = corners[k].at, &next = corners[k + 1].at;
        const double turn = glm::dot(at - last, next - at);
        const bool turnsBack = turn < kBack * glm::distance(last, at) * glm::distance(at, next);
        if (turnsBack || distanceToSegment(at, last, next) <= corners[k].accuracy) {
            corners.erase(corners.begin() + std::ptrdiff_t(k));
            k = std::max(k, size_t(2)) - 1;
        } else {
            ++k;
        }
    }
}

// Two open ends of lines that may be joined. An end is numbered 2 * line + 1 if it is the last
// point, and 2 * line if it is the first.
struct Gap {
    double width;  // m
    size_t one, other;
    bool operator<(const Gap& o) const {
        return std::tie(width, one, other) < std::tie(o.width, o.one, o.other);
    }
};

std::vector<Gap> gapsBetween(const std::vector<PointLine>& lines) {
    struct End {
        int32_t face;
        double x;  // m
        size_t number;
        bool operator<(const End& o) const {
            return std::tie(face, x, number) < std::tie(o.face, o.x, o.number);
        }
    };
    std::vector<End> ends;
    double widest = 0;
    for (size_t e = 0; e < 2 * lines.size(); ++e) {
        const PointLine& line = lines[e / 2];
        if (!line.isOpen[e % 2]) continue;
        ends.push_back({line.face, line.end(e % 2).at.x, e});
        widest = std::max(widest, kGap * line.end(e % 2).edge);
    }
    std::sort(ends.begin(), ends.end());
    std::vector<Gap> gaps;
    for (size_t a = 0; a < ends.size(); ++a) {
        throwIfCancelledAt(a);
        for (size_t b = a + 1; b < ends.size(); ++b) {
            if (ends[b].face != ends[a].face || ends[b].x - ends[a].x > widest) break;
            const size_t i = ends[a].number, j = ends[b].number;
            const PointLine &one = lines[i / 2], &other = lines[j / 2];
            if (i / 2 == j / 2 && one.points.size() < kRing) continue;
            const LinePoint &p = one.end(i % 2), &q = other.end(j % 2);
            const double width = glm::distance(p.at, q.at);
            if (width > kGap * std::max(p.edge, q.edge)) continue;
            const glm::dvec3 u = one.outwards(i % 2), v = other.outwards(j % 2);
            if (glm::dot(u, v) > kBeside * glm::length(u) * glm::length(v)) continue;
            // Across a wide gap, no line turns back.
            const bool isWide = width > kNarrowLength * std::max(p.edge, q.edge);
            if (isWide && (glm::dot(u, q.at - p.at) < 0 || glm::dot(v, p.at - q.at) < 0)) continue;
            gaps.push_back({width, i, j});
        }
    }
    std::sort(gaps.begin(), gaps.end());
    return gaps;
}

}  // namespace

glm::dvec3 PointLine::outwards(bool isLast) const {
    const size_t last = points.size() - 1, before = std::min(last, kLongSide);
    return isLast ? points[last].at - points[last - before].at : points[0].at - points[before].at;
}

double PointLine::length() const {
    double sum = 0;
    for (size_t k = 1; k < points.size(); ++k) sum += glm::distance(points[k - 1].at, points[k].at);
    return sum;
}

double PointLine::meanEdge() const {
    double sum = 0;
    for (const LinePoint& point : points) sum += point.edge;
    return sum / double(points.size());
}

double PointLine::width() const {
    double sum = 0;
    for (size_t k = 0; k < points.size(); ++k) {
        const size_t before = k > 0 ? k - 1 : 0, after = std::min(k + 1, points.size() - 1);
        const glm::dvec3 along = points[after].at - points[before].at;
        const double length = glm::length(along);
        if (length > 0) sum += glm::length(glm::cross(points[k].soft, along)) / length;
    }
    return sum / double(points.size());
}

std::vector<PointLine> joinEnds(const std::vector<PointLine>& lines) {
    std::vector<size_t> partner(2 * lines.size(), kNoEnd);
    for (const Gap& gap : gapsBetween(lines)) {
        if (partner[gap.one] != kNoEnd || partner[gap.other] != kNoEnd) continue;
        partner[gap.one] = gap.other;
        partner[gap.other] = gap.one;
    }
    std::vector<PointLine> result;
    std::vector<uint8_t> isTaken(lines.size(), 0);
    auto follow = [&](size_t start) {
        PointLine all{lines[start / 2].face};
        all.isOpen[0] = lines[start / 2].isOpen[start % 2] && partner[start] == kNoEnd;
        all.edge[0] = lines[start / 2].edge[start % 2];
        for (size_t at = start; at != kNoEnd && !isTaken[at / 2];) {
            const PointLine& line = lines[at / 2];
            isTaken[at / 2] = 1;
            if (at % 2 == 0)
                all.points.insert(all.points.end(), line.points.begin(), line.points.end());
            else
                all.points.insert(all.points.end(), line.points.rbegin(), line.points.rend());
            all.jump = std::max(all.jump, line.jump);
            const size_t last = at ^ 1;
            all.isOpen[1] = line.isOpen[last % 2] && partner[last] == kNoEnd;
            all.edge[1] = line.edge[last % 2];
            at = partner[last];
        }
        if (partner[start] != kNoEnd) all.points.push_back(all.points.front());  // a ring
        result.push_back(std::move(all));
    };
    for (size_t end = 0; end < partner.size(); ++end)
        if (partner[end] == kNoEnd && !isTaken[end / 2]) follow(end);
    for (size_t end = 0; end < partner.size(); ++end)
        if (!isTaken[end / 2]) follow(end);
    return result;
}

std::vector<glm::dvec3> cornersOf(const PointLine& line) {
    const std::vector<LinePoint>& points = line.points;
    const std::vector<size_t> needed = neededPoints(points);
    auto side = [&](size_t k) -> std::optional<Straight> {  // from needed point k to the next
        if (k + 1 >= needed.size() || needed[k + 1] - needed[k] < kLongSide) return {};
        return nearestLine(points, needed[k], needed[k + 1]);
    };
    std::vector<LinePoint> corners;
    for (size_t k = 0; k < needed.size(); ++k) {
        LinePoint here = points[needed[k]];
        const auto before = k > 0 ? side(k - 1) : std::nullopt;
        const bool isShort = k + 1 < needed.size() && needed[k + 1] - needed[k] <= kShortSide;
        const bool isCut = isShort && before && side(k + 1) &&
                           areOn(points, needed[k], needed[k + 1], *before, *side(k + 1));
        const size_t end = isCut ? k + 1 : k;
        const auto after = side(end);
        if (before && after) {
            const auto corner = meeting(*before, *after);
            const LinePoint& other = points[needed[end]];
            const double reach = std::max(2 * std::max(here.edge, other.edge),
                                          1.5 * glm::distance(here.at, other.at));
            if (corner && glm::distance(*corner, here.at) < reach &&
                glm::distance(*corner, other.at) < reach) {
                here.at = *corner;
                k = end;
            }
        } else if (k == 0 && after && !isCut && line.isOpen[0]) {
            here.at = after->nearest(here.at);
        } else if (k + 1 == needed.size() && before && line.isOpen[1]) {
            here.at = before->nearest(here.at);
        }
        corners.push_back(here);
    }
    removeFlat(corners);
    std::vector<glm::dvec3> places;
    for (const LinePoint& corner : corners) places.push_back(corner.at);
    return places;
}

}  // namespace raybundle
