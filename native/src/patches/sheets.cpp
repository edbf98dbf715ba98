// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/sheets.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>

#include "job/cancellation.h"
#include "patches/patches.h"
#include "sampling/mix_bits.h"

namespace raybundle {
namespace {

// Difference up to which the edges of parents count as congruent, relative to the longer edge.
constexpr float kCongruence = 1e-4f;
// Tolerances of the position of a vertex on a sheet. Across the sheet, kFlatness is relative to the
// reach of the island: a rounding error of a few units in the last place. Along the sheet,
// kEvenness is relative to the edges of the members.
constexpr float kFlatness = 3e-7f, kEvenness = 0.01f;

// A parallelogram that may become part of a sheet.
struct Member {
    std::array<uint32_t, 4> vertex;  // in order around, as Parent::vertex
    uint32_t firstParent, parentCount;
    int countA, countB;  // tiles along its edges; 0 if it is uneven

    bool isUneven() const { return countA == 0; }
};

// A member at a position of a lattice, possibly turned. Corner k of the position (in order around,
// from (0, 0)) is vertex (k + turn) % 4 of the member.
struct Place {
    const Member* member = nullptr;
    int turn = 0;

    uint32_t vertex(int corner) const { return member->vertex[size_t(corner + turn) % 4]; }
    glm::vec3 position(const Patches& patches, int corner) const {
        return patches.vertices[vertex(corner)];
    }
    // Tiles along the two directions of the lattice.
    int countA() const { return turn % 2 ? member->countB : member->countA; }
    int countB() const { return turn % 2 ? member->countA : member->countB; }
};

// A position in a lattice: column and row.
using At = std::array<int, 2>;
struct HashAt {
    size_t operator()(const At& at) const {
        return size_t(mixBits(uint64_t(uint32_t(at[0])) << 32 | uint32_t(at[1])));
    }
};
using Lattice = std::unordered_map<At, Place, HashAt>;

// The steps to the neighbours across the four edges of a position, in order around.
constexpr At kSteps[4] = {{0, -1}, {1, 0}, {0, 1}, {-1, 0}};

// Grows lattices of congruent members, and cuts them into rectangular sheets.
class SheetSearch {
  public:
    explicit SheetSearch(const Patches& patches) : patches(patches) {}

    Sheets run() {
        findMembers();
        listEdges();
        isPlaced.assign(members.size(), false);
        // Sheets start at even members, which uneven ones may join.
        for (uint32_t i = 0; i < members.size(); ++i) {
            throwIfCancelledAt(i);
            if (!isPlaced[i] && !members[i].isUneven()) cutIntoSheets(growFrom(i));
        }
        for (uint32_t i = 0; i < members.size(); ++i)
            if (!isPlaced[i]) leaveLoose(members[i]);
        // Restore the order of the faces, whose vertices are close to each other in memory.
        std::sort(result.loose.begin(), result.loose.end());
        return std::move(result);
    }

  private:
    // Finds the parallelograms among the parents. Triangles become loose at once.
    void findMembers() {
        auto crossed = patches.crossedCells.begin();
        for (uint32_t i = 0; i < patches.parents.size(); ++i) {
            throwIfCancelledAt(i);
            const Parent& parent = patches.parents[i];
            const bool isCrossed =
                crossed != patches.crossedCells.end() && crossed->firstParent == i;
            const uint32_t count = isCrossed ? crossed->parentCount : 1;
            if (parent.exchanges && isCrossed)
                members.push_back({crossed->vertex, i, count, 0, 0});
            else if (parent.exchanges && parent.isTriangle)
                result.loose.push_back(i);
            else if (parent.exchanges)
                members.push_back({parent.vertex, i, 1, parent.cut ? 0 : int(parent.countA),
                                   parent.cut ? 0 : int(parent.countB)});
            if (isCrossed) ++crossed;
            i += count - 1;
        }
    }

    void leaveLoose(const Member& member) {
        for (uint32_t k = 0; k < member.parentCount; ++k)
            result.loose.push_back(member.firstParent + k);
    }

    // Edge `side` of a member, by its two vertices in the order around the member.
    struct Edge {
        uint64_t key;
        uint32_t member;
        int side;
        bool operator<(const Edge& other) const {
            return key != other.key ? key < other.key : member < other.member;
        }
    };
    static uint64_t keyOf(uint32_t from, uint32_t to) { return uint64_t(from) << 32 | to; }

    void listEdges() {
        for (uint32_t i = 0; i < members.size(); ++i) {
            throwIfCancelledAt(i);
            const auto& v = members[i].vertex;
            for (int k = 0; k < 4; ++k)
                edges.push_back({keyOf(v[size_t(k)], v[size_t(k + 1) % 4]), i, k});
        }
        tbb::parallel_sort(edges.begin(), edges.end());
    }

    // Returns the lattice of all members that are congruent to this one and connected to it by
    // edges.
    Lattice growFrom(uint32_t start) {
        Lattice lattice;
        const Place first{&members[start], 0};
        lattice.emplace(At{0, 0}, first);
        isPlaced[start] = true;
        std::vector<At> open{{0, 0}};
        while (!open.empty()) {
            const At at = open.back();
            open.pop_back();
            const Place place = lattice.at(at);
            for (int side = 0; side < 4; ++side) {
                const At next{at[0] + kSteps[side][0], at[1] + kSteps[side][1]};
                if (lattice.count(next)) continue;
                const std::optional<Place> found = across(place, side);
                if (!found || !isCongruent(first, *found)) continue;
                lattice.emplace(next, *found);
                isPlaced[size_t(found->member - members.data())] = true;
                open.push_back(next);
            }
        }
        return lattice;
    }

    // Returns the unplaced member across an edge of a position, turned as the lattice is. The edge
    // runs in opposite directions in both members, so that they belong to one orientable surface.
    std::optional<Place> across(const Place& place, int side) const {
        const uint32_t from = place.vertex(side), to = place.vertex((side + 1) % 4);
        const uint64_t key = keyOf(to, from);
        auto edge = std::lower_bound(edges.begin(), edges.end(), Edge{key, 0, 0});
        for (; edge != edges.end() && edge->key == key; ++edge)
            // In the position of the neighbour, the common edge is side (side + 2) % 4.
            if (!isPlaced[edge->member])
                return Place{&members[edge->member], (edge->side + 6 - side) % 4};
        return std::nullopt;
    }

    bool isCongruent(const Place& first, const Place& other) const {
        if (!other.member->isUneven() &&
            (first.countA() != other.countA() || first.countB() != other.countB()))
            return false;
        const glm::vec3 a = edgeA(first), b = edgeB(first);
        const float off = kCongruence * std::max(glm::length(a), glm::length(b));
        return glm::distance(a, edgeA(other)) <= off && glm::distance(b, edgeB(other)) <= off;
    }
    glm::vec3 edgeA(const Place& p) const {
        return p.position(patches, 1) - p.position(patches, 0);
    }
    glm::vec3 edgeB(const Place& p) const {
        return p.position(patches, 3) - p.position(patches, 0);
    }

    // Cuts a lattice into rectangles: row by row, always the widest rectangle that is left.
    void cutIntoSheets(Lattice lattice) {
        const Place& any = lattice.at({0, 0});
        const uint32_t countA = uint32_t(any.countA()), countB = uint32_t(any.countB());
        std::vector<At> order;
        for (const auto& entry : lattice) order.push_back(entry.first);
        std::sort(order.begin(), order.end(), [](const At& p, const At& q) {
            return p[1] != q[1] ? p[1] < q[1] : p[0] < q[0];
        });
        for (const At& low : order) {
            if (!lattice.count(low)) continue;
            At high = low;  // first column and row outside the rectangle
            while (lattice.count({high[0], low[1]})) ++high[0];
            auto isWhole = [&](int row) {
                for (int x = low[0]; x < high[0]; ++x)
                    if (!lattice.count({x, row})) return false;
                return true;
            };
            while (isWhole(high[1])) ++high[1];
            addSheet(lattice, low, high, countA, countB);
            for (int y = low[1]; y < high[1]; ++y)
                for (int x = low[0]; x < high[0]; ++x) lattice.erase({x, y});
        }
    }

    // Makes a sheet of a rectangle of a lattice, or leaves its members loose if they do not fit.
    // `countA` and `countB` are the tiles along the edges of an even member.
    void addSheet(const Lattice& lattice, const At& low, const At& high, uint32_t countA,
                  uint32_t countB) {
        const int width = high[0] - low[0], height = high[1] - low[1];
        auto at = [&](int x, int y) -> const Place& {
            return lattice.at({low[0] + x, low[1] + y});
        };
        Sheet sheet;
        sheet.origin = at(0, 0).position(patches, 0);
        sheet.a = at(width - 1, 0).position(patches, 1) - sheet.origin;
        sheet.b = at(0, height - 1).position(patches, 3) - sheet.origin;
        bool isOne = width * height > 1;
        for (int y = 0; y < height && isOne; ++y)
            for (int x = 0; x < width && isOne; ++x)
                isOne = fits(sheet, at(x, y), x, y, width, height);
        auto addEdge = [&](const Place& place, int side) {
            sheet.outline.push_back({place.vertex(side), place.vertex((side + 1) % 4)});
        };
        for (int x = 0; x < width; ++x) addEdge(at(x, 0), 0);
        for (int y = 0; y < height; ++y) addEdge(at(width - 1, y), 1);
        for (int x = width - 1; x >= 0; --x) addEdge(at(x, height - 1), 2);
        for (int y = height - 1; y >= 0; --y) addEdge(at(0, y), 3);
        // Members that are connected along some edges may have separate vertices along others. The
        // outline must then not be a closed loop of vertices.
        for (size_t k = 0; k < sheet.outline.size(); ++k)
            isOne =
                isOne && sheet.outline[k][1] == sheet.outline[(k + 1) % sheet.outline.size()][0];
        if (!isOne) {
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) leaveLoose(*at(x, y).member);
            return;
        }

        sheet.island = patches.parents[at(0, 0).member->firstParent].island;
        sheet.columns = uint32_t(width) * countA;
        sheet.rows = uint32_t(height) * countB;
        sheet.patches.resize(size_t(sheet.columns) * sheet.rows);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const Place& place = at(x, y);
                result.joined += place.member->parentCount;
                const uint32_t uneven = Sheet::kUneven + uint32_t(sheet.firstPart.size());
                if (place.member->isUneven()) addParts(sheet, *place.member);
                for (uint32_t row = 0; row < countB; ++row)
                    for (uint32_t column = 0; column < countA; ++column)
                        sheet.patches[(uint32_t(y) * countB + row) * size_t(sheet.columns) +
                                      uint32_t(x) * countA + column] =
                            place.member->isUneven() ? uneven : patchOf(place, column, row);
            }
        sheet.firstPart.push_back(uint32_t(sheet.parts.size()));
        result.sheets.push_back(std::move(sheet));
    }

    // Adds the parents of an uneven member to the parts of a sheet.
    void addParts(Sheet& sheet, const Member& member) const {
        sheet.firstPart.push_back(uint32_t(sheet.parts.size()));
        const glm::dvec3 origin(sheet.origin), a(sheet.a), b(sheet.b);
        for (uint32_t p = member.firstParent; p < member.firstParent + member.parentCount; ++p) {
            const Parent& parent = patches.parents[p];
            const glm::vec2 at = parent.affineAt(origin);
            sheet.parts.push_back(
                {p, at, parent.affineAt(origin + a) - at, parent.affineAt(origin + b) - at});
        }
    }

    // Returns whether the vertices of the member in column x and row y lie where the sheet expects
    // them.
    bool fits(const Sheet& sheet, const Place& place, int x, int y, int width, int height) const {
        const glm::vec3 a = sheet.a / float(width), b = sheet.b / float(height);
        const glm::vec3 normal = glm::normalize(glm::cross(sheet.a, sheet.b));
        const float reach =
            patches.islands[patches.parents[place.member->firstParent].island].reach;
        constexpr int kCorners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
        for (int k = 0; k < 4; ++k) {
            const glm::vec3 off = place.position(patches, k) - sheet.origin -
                                  float(x + kCorners[k][0]) * a - float(y + kCorners[k][1]) * b;
            if (std::abs(glm::dot(off, normal)) > kFlatness * reach ||
                glm::length(off) > kEvenness * std::min(glm::length(a), glm::length(b)))
                return false;
        }
        return true;
    }

    // Returns the patch in a column and row of an even member, as the member is turned in the
    // lattice.
    uint32_t patchOf(const Place& place, uint32_t column, uint32_t row) const {
        const Parent& parent = patches.parents[place.member->firstParent];
        const uint32_t a = parent.countA, b = parent.countB;
        // Vertex `turn` of the parent lies at (0, 0) of the position, from which column and row are
        // counted.
        switch (place.turn) {
            case 1:
                std::swap(column, row);
                column = a - 1 - column;
                break;
            case 2:
                column = a - 1 - column;
                row = b - 1 - row;
                break;
            case 3:
                std::swap(column, row);
                row = b - 1 - row;
                break;
            default:
                break;
        }
        return parent.firstPatch + row * a + column;
    }

    const Patches& patches;
    std::vector<Edge> edges;  // sorted by key
    std::vector<Member> members;
    std::vector<bool> isPlaced;  // per member
    Sheets result;
};

}  // namespace

uint32_t Sheet::patchIn(uint32_t uneven, const Patches& all, float s, float t) const {
    const Part* const end = parts.data() + firstPart[uneven - kUneven + 1];
    const Part* best = parts.data() + firstPart[uneven - kUneven];
    float most = -std::numeric_limits<float>::infinity();
    glm::vec2 at(0.0f);
    // Search for a parent that contains the point. Rounding may leave none: then take the nearest.
    for (const Part* part = best; part != end && most < 0; ++part) {
        const glm::vec2 st = part->origin + s * part->a + t * part->b;
        // The distance inside the parent, relative to its size; negative outside.
        const float inside = std::min(std::min(st.x, st.y), all.parents[part->parent].isTriangle
                                                                ? 1 - st.x - st.y
                                                                : 1 - std::max(st.x, st.y));
        if (!(inside > most)) continue;
        best = part;
        most = inside;
        at = st;
    }
    const Parent& parent = all.parents[best->parent];
    return parent.firstPatch + parent.patchAt(at.x, at.y);
}

Sheets findSheets(const Patches& patches) { return SheetSearch(patches).run(); }

Sheets withoutSheets(const Patches& patches) {
    Sheets result;
    for (uint32_t i = 0; i < patches.parents.size(); ++i)
        if (patches.parents[i].exchanges) result.loose.push_back(i);
    return result;
}

}  // namespace raybundle
