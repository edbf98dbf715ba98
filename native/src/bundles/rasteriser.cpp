// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/rasteriser.h"

#include <numeric>

namespace raybundle {

Rasteriser::Rasteriser(const Patches& patches, float pixelSize, SmallPatches smallPatches,
                       std::vector<LineWindow> windows)
    : patches(patches),
      pixelSize(pixelSize),
      smallPatches(smallPatches),
      windows(std::move(windows)) {
    islands.resize(std::max<size_t>(1, patches.islands.size()));
    const bool all = smallPatches == SmallPatches::ROULETTE;
    // Per vertex: 1 plus the index of the last island that uses it.
    std::vector<uint32_t> user(patches.vertices.size(), 0);
    auto use = [&](uint32_t island, uint32_t vertex) {
        if (user[vertex] == island + 1) return;
        user[vertex] = island + 1;
        islands[island].vertices.push_back(vertex);
    };
    const std::vector<Sheet>& sheets = patches.sheets.sheets;
    for (uint32_t i = 0; i < sheets.size(); ++i) {
        islands[sheets[i].island].sheets.push_back(i);
        for (const auto& edge : sheets[i].outline) use(sheets[i].island, edge[0]);
    }
    auto useAll = [&](const Parent& parent) {
        for (int k = 0; k < (parent.isTriangle ? 3 : 4); ++k)
            use(parent.island, parent.vertex[size_t(k)]);
    };
    for (uint32_t i = 0; i < patches.sheets.loose.size(); ++i) {
        const Parent& parent = patches.parents[patches.sheets.loose[i]];
        std::array<uint32_t, 4> vertex = parent.vertex;
        if (parent.isTriangle) vertex[3] = vertex[0];
        islands[parent.island].loose.push_back({patches.sheets.loose[i], vertex});
        useAll(parent);
    }
    if (all)
        for (const Parent& parent : patches.parents) useAll(parent);
    for (const LineWindow& window : this->windows)
        finestLevel = std::max(finestLevel, window.level);
}

void Rasteriser::begin(const Bundle& bundle) {
    frame = bundle;
    if (!patches.opacity.empty()) line = lineName(bundle);
    if (smallPatches == SmallPatches::ROULETTE) roulette.begin(bundle);
    projected.resize(patches.vertices.size());
    depth.resize(patches.vertices.size());
    const double perPixel = 1 / double(pixelSize);
    Rectangle whole;
    std::vector<uint32_t> shown;
    for (uint32_t k = 0; k < islands.size(); ++k) {
        Island& island = islands[k];
        glm::dvec3 low(std::numeric_limits<double>::max()),
            high(-std::numeric_limits<double>::max());
        for (uint32_t v : island.vertices) {
            const glm::dvec3 p(patches.vertices[v]);
            const glm::dvec3 q(glm::dot(p, frame.right) * perPixel,
                               glm::dot(p, frame.up) * perPixel, glm::dot(p, frame.direction));
            low = glm::min(low, q);
            high = glm::max(high, q);
            projected[v] = glm::dvec2(q);
            depth[v] = q.z;
        }
        if (island.vertices.empty()) continue;
        shown.push_back(k);
        island.shadow = {glm::dvec2(low), glm::dvec2(high)};
        island.lowest = low.z;
        island.highest = high.z;
        whole.low = glm::min(whole.low, island.shadow.low);
        whole.high = glm::max(whole.high, island.shadow.high);
    }
    if (shown.empty()) whole.low = whole.high = glm::dvec2(0.0);
    findRegions();
    showIslands(shown, whole.low, whole.high);
    if (windows.empty()) return;

    for (uint32_t k : shown) findBounds(islands[k]);
    // The shadows of the boxes do not depend on the shift. Otherwise the density of lines near
    // their borders would not be uniform.
    openings.clear();
    const glm::dmat3 axes(patches.axes);
    const glm::dvec3 right = axes * frame.right, up = axes * frame.up;
    for (const LineWindow& window : windows) {
        const glm::dvec3 middle(0.5f * (window.low + window.high));
        const glm::dvec3 half(0.5f * (window.high - window.low));
        const glm::dvec2 at(glm::dot(middle, right), glm::dot(middle, up));
        const glm::dvec2 reach(glm::dot(half, glm::abs(right)), glm::dot(half, glm::abs(up)));
        openings.push_back({(at - reach) * perPixel, (at + reach) * perPixel});
    }
    findTaken(windows.size());
}

void Rasteriser::Bounds::add(const glm::dvec2& point) {
    for (int c = 0; c < 2; ++c) {
        const float nearest = float(point[c]);
        const float step = std::abs(nearest) * std::numeric_limits<float>::epsilon();
        low[c] = std::min(low[c], nearest - step);
        high[c] = std::max(high[c], nearest + step);
    }
}

void Rasteriser::findBounds(Island& island) {
    island.sheetBounds.clear();
    for (uint32_t i : island.sheets) {
        Bounds bounds;
        for (const auto& edge : patches.sheets.sheets[i].outline) bounds.add(projected[edge[0]]);
        island.sheetBounds.push_back(bounds);
    }
    island.looseBounds.clear();
    island.groupBounds.assign((island.loose.size() + kGroup - 1) / kGroup, Bounds());
    for (size_t k = 0; k < island.loose.size(); ++k) {
        Bounds bounds;
        for (uint32_t vertex : island.loose[k].vertex) bounds.add(projected[vertex]);
        island.looseBounds.push_back(bounds);
        island.groupBounds[k / kGroup].add(bounds);
    }
}

void Rasteriser::showIslands(std::vector<uint32_t> shown, const glm::dvec2& low,
                             const glm::dvec2& high) {
    inSight = std::move(shown);
    lowest = highest = 0;
    for (size_t k = 0; k < inSight.size(); ++k) {
        const Island& island = islands[inSight[k]];
        lowest = k == 0 ? island.lowest : std::min(lowest, island.lowest);
        highest = k == 0 ? island.highest : std::max(highest, island.highest);
    }
    // Move the view to the scene by whole pixels, so that its corner does not cancel the random
    // shift.
    level = 0;
    zoom = 1;
    corner = glm::floor(low) - frame.shift;
    // One pixel more than needed, for the rounding to float. The view of a vast scene may exceed
    // the limit on pixels, but such a scene is viewed in regions.
    constexpr double kMost = 1 << 30;
    width = int(std::min(kMost, high.x - corner.x)) + 2;
    height = int(std::min(kMost, high.y - corner.y)) + 2;
}

// Merges shadows that share pixels into regions, and regions that share pixels into larger ones, by
// a sweep along x that is repeated until nothing changes.
void Rasteriser::findRegions() {
    regions.clear();
    for (uint32_t k = 0; k < islands.size(); ++k) {
        if (islands[k].vertices.empty()) continue;
        const Rectangle& shadow = islands[k].shadow;
        // As large as the view of the island.
        const glm::dvec2 first = glm::floor(shadow.low);
        regions.push_back(
            {first, first + glm::floor(shadow.high - first + frame.shift) + 2.0, {k}});
    }
    for (bool isDone = regions.size() < 2; !isDone;) {
        isDone = true;
        std::stable_sort(regions.begin(), regions.end(),
                         [](const Region& a, const Region& b) { return a.first.x < b.first.x; });
        for (size_t i = 0; i < regions.size(); ++i) {
            Region& region = regions[i];
            if (region.islands.empty()) continue;
            for (size_t j = i + 1; j < regions.size() && regions[j].first.x < region.end.x; ++j) {
                Region& other = regions[j];
                if (other.islands.empty() || other.first.y >= region.end.y ||
                    other.end.y <= region.first.y)
                    continue;
                region.first = glm::min(region.first, other.first);
                region.end = glm::max(region.end, other.end);
                region.islands.insert(region.islands.end(), other.islands.begin(),
                                      other.islands.end());
                other.islands.clear();
                isDone = false;
            }
        }
        regions.erase(std::remove_if(regions.begin(), regions.end(),
                                     [](const Region& region) { return region.islands.empty(); }),
                      regions.end());
    }
    for (Region& region : regions) std::sort(region.islands.begin(), region.islands.end());
}

void Rasteriser::lookAt(size_t region) {
    Rectangle around;
    for (uint32_t k : regions[region].islands) {
        around.low = glm::min(around.low, islands[k].shadow.low);
        around.high = glm::max(around.high, islands[k].shadow.high);
    }
    showIslands(regions[region].islands, around.low, around.high);
    if (!patches.opacity.empty()) line = lineName(frame) + (region ? mixBits(region << 32) : 0);
    if (!windows.empty()) findTaken(windows.size());
}

bool Rasteriser::lookThrough(size_t window) {
    level = windows[window].level;
    zoom = std::ldexp(1.0, level);
    // Use other lines than those of pixels with equal indices in other views.
    if (!patches.opacity.empty()) line = lineName(frame) + mixBits(window + 1);
    // The grid is shifted by the same length as that of the whole scene. The shift is then also
    // uniform over the smaller pixel.
    const glm::dvec2 shift = glm::fract(frame.shift * zoom);
    // Pixels whose centres lie in the opening.
    const glm::dvec2 first = glm::ceil(openings[window].low * zoom + shift - 0.5);
    const glm::dvec2 last = glm::ceil(openings[window].high * zoom + shift - 0.5);
    corner = first - shift;
    width = int(last.x - first.x);
    height = int(last.y - first.y);
    if (width <= 0 || height <= 0) return false;
    inSight.clear();
    for (uint32_t k = 0; k < islands.size(); ++k) {
        const Island& island = islands[k];
        if (island.vertices.empty() || !isInView(island.shadow)) continue;
        // The shadow of a long wire overlaps many views, but the wire itself only a few.
        auto isSeen = [&](const Bounds& bounds) { return isInView(bounds); };
        if (islands.size() > 1 &&
            std::none_of(island.sheetBounds.begin(), island.sheetBounds.end(), isSeen) &&
            std::none_of(island.groupBounds.begin(), island.groupBounds.end(), isSeen))
            continue;
        lowest = inSight.empty() ? island.lowest : std::min(lowest, island.lowest);
        highest = inSight.empty() ? island.highest : std::max(highest, island.highest);
        inSight.push_back(k);
    }
    findTaken(window);
    return true;
}

void Rasteriser::findTaken(size_t window) {
    taken.clear();
    for (size_t k = 0; k < windows.size(); ++k) {
        const bool isFiner = windows[k].level > level || (windows[k].level == level && k < window);
        if (k == window || !isFiner) continue;
        const glm::dvec2 first = glm::ceil(openings[k].low * zoom - corner - 0.5);
        const glm::dvec2 last = glm::ceil(openings[k].high * zoom - corner - 0.5);
        const int x0 = int(std::max(0.0, first.x)), x1 = int(std::min(double(width), last.x));
        const int y0 = int(std::max(0.0, first.y)), y1 = int(std::min(double(height), last.y));
        if (x0 >= x1 || y0 >= y1) continue;
        taken.resize(pixelCount(), 0);
        for (int y = y0; y < y1; ++y)
            std::fill_n(taken.begin() + ptrdiff_t(y) * width + x0, x1 - x0, uint8_t(1));
    }
}

bool Rasteriser::findPlane(const Axes& axes, Plane& plane) const {
    // Computed in double from world coordinates, so that coinciding faces of different objects have
    // equal depths.
    const glm::dvec3 o(axes.origin), da(axes.a), db(axes.b), normal = glm::cross(da, db);
    const double slant = glm::dot(normal, frame.direction);
    if (slant == 0) return false;
    const double size = double(pixelSize) / zoom;
    const glm::dvec2 first = (corner + 0.5) * size;  // centre of pixel (0, 0), metres
    plane.dzdx = -glm::dot(normal, frame.right) / slant * size;
    plane.dzdy = -glm::dot(normal, frame.up) / slant * size;
    plane.z0 =
        glm::dot(normal, o) / slant + (corner.x + 0.5) * plane.dzdx + (corner.y + 0.5) * plane.dzdy;
    // (right, up, direction) is right-handed, so the front faces against the direction if the
    // outline is clockwise.
    plane.facing = slant < 0 ? 0 : 1;
    const glm::dvec2 ea(glm::dot(da, frame.right), glm::dot(da, frame.up)),
        eb(glm::dot(db, frame.right), glm::dot(db, frame.up));
    const glm::dvec2 to = first - glm::dvec2(glm::dot(o, frame.right), glm::dot(o, frame.up));
    const double inverse = 1 / slant;
    plane.s0 = (to.x * eb.y - to.y * eb.x) * inverse;
    plane.dsdx = eb.y * inverse * size;
    plane.dsdy = -eb.x * inverse * size;
    plane.t0 = (to.y * ea.x - to.x * ea.y) * inverse;
    plane.dtdx = -ea.y * inverse * size;
    plane.dtdy = ea.x * inverse * size;
    return true;
}

}  // namespace raybundle
