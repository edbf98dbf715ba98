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

// Share of the longer edge by which the edges of congruent parents may differ.
constexpr float kCongruence = 1e-4f;
// How far a vertex may lie from its place on the sheet: across it, as a share of how far its island
// reaches (what rounding to float leaves, some units in the last place), and along it, as a share
// of the parents' edges.
constexpr float kFlatness = 3e-7f, kEvenness = 0.01f;

// A parallelogram that may be part of a sheet.
struct Member {
    std::array<uint32_t, 4> vertex;  // as in Parent
    uint32_t firstParent, parentCount;
    int countA, countB;  // patches along its edges; 0 where it is uneven

    bool isUneven() const { return countA == 0; }
};

// A member in a lattice: corner k of its place there (in order around, (0, 0) first) is its vertex
// (k + turn) % 4.
struct Place {
    const Member* member = nullptr;
    int turn = 0;

    uint32_t vertex(int corner) const { return member->vertex[size_t(corner + turn) % 4]; }
    glm::vec3 position(const Patches& patches, int corner) const {
        return patches.vertices[vertex(corner)];
    }
    // Patches along the lattice's two directions.
    int countA() const { return turn % 2 ? member->countB : member->countA; }
    int countB() const { return turn % 2 ? member->countA : member->countB; }
};

// Where in a lattice.
using At = std::array<int, 2>;
struct HashAt {
    size_t operator()(const At& at) const {
        return size_t(mixBits(uint64_t(uint32_t(at[0])) << 32 | uint32_t(at[1])));
    }
};
using Lattice = std::unordered_map<At, Place, HashAt>;

// The steps across a parent's edges, in order around.
constexpr At kSteps[4] = {{0, -1}, {1, 0}, {0, 1}, {-1, 0}};

class SheetSearch {
  public:
    explicit SheetSearch(const Patches& patches) : patches(patches) {}

    Sheets run() {
        findMembers();
        listEdges();
        isPlaced.assign(members.size(), false);
        // What is uneven joins others.
        for (uint32_t i = 0; i < members.size(); ++i) {
            throwIfCancelledAt(i);
            if (!isPlaced[i] && !members[i].isUneven()) cutIntoSheets(growFrom(i));
        }
        for (uint32_t i = 0; i < members.size(); ++i)
            if (!isPlaced[i]) leaveLoose(members[i]);
        // The order of the faces, in which their vertices lie beside each other.
        std::sort(result.loose.begin(), result.loose.end());
        return std::move(result);
    }

  private:
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

    // A member's edge by its two vertices in order around.
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

    // The lattice of all members like this one that are joined to it by edges.
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

    // What lies across an edge, as part of the same surface.
    std::optional<Place> across(const Place& place, int side) const {
        const uint32_t from = place.vertex(side), to = place.vertex((side + 1) % 4);
        const uint64_t key = keyOf(to, from);
        auto edge = std::lower_bound(edges.begin(), edges.end(), Edge{key, 0, 0});
        for (; edge != edges.end() && edge->key == key; ++edge)
            // The edge is side (side + 2) % 4 of its place.
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

    // Row by row, the widest rectangles that are left.
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
            At high = low;  // the first column and row beyond
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

    // countA, countB: patches along the edges of a member that is not uneven.
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
        // Parents that are one with others along some edges only have vertices of their own
        // elsewhere.
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

    // Whether the vertices of the member in column x and row y are where the sheet has them.
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

    // The patch in a column and row of a member that is no other than a parent, as it lies in the
    // lattice.
    uint32_t patchOf(const Place& place, uint32_t column, uint32_t row) const {
        const Parent& parent = patches.parents[place.member->firstParent];
        const uint32_t a = parent.countA, b = parent.countB;
        // Vertex `turn` is the lattice's (0, 0), from where the parent's own column and row run.
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
    std::vector<Edge> edges;  // in order of their keys
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
    // Until one holds the point: by a rounding error none may.
    for (const Part* part = best; part != end && most < 0; ++part) {
        const glm::vec2 st = part->origin + s * part->a + t * part->b;
        // How far inside, in shares of the parent.
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
