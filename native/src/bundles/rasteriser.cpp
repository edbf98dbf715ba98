// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/rasteriser.h"

namespace raybundle {

Rasteriser::Rasteriser(const Patches& patches, float pixelSize, SmallPatches smallPatches,
                       std::vector<LineWindow> windows)
    : patches(patches),
      pixelSize(pixelSize),
      smallPatches(smallPatches),
      windows(std::move(windows)) {
    std::vector<bool> isUsed(patches.vertices.size(), smallPatches == SmallPatches::ROULETTE);
    for (const Sheet& sheet : patches.sheets.sheets)
        for (const auto& edge : sheet.outline) isUsed[edge[0]] = true;
    for (uint32_t i : patches.sheets.loose)
        for (int k = 0; k < (patches.parents[i].isTriangle ? 3 : 4); ++k)
            isUsed[patches.parents[i].vertex[size_t(k)]] = true;
    for (uint32_t v = 0; v < isUsed.size(); ++v)
        if (isUsed[v]) vertices.push_back(v);
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
    glm::dvec3 low(std::numeric_limits<double>::max()), high(-std::numeric_limits<double>::max());
    for (uint32_t v : vertices) {
        const glm::dvec3 p(patches.vertices[v]);
        const glm::dvec3 q(glm::dot(p, frame.right) * perPixel, glm::dot(p, frame.up) * perPixel,
                           glm::dot(p, frame.direction));
        low = glm::min(low, q);
        high = glm::max(high, q);
        projected[v] = glm::dvec2(q);
        depth[v] = q.z;
    }
    if (vertices.empty()) low = high = glm::dvec3(0.0);
    // Move the view to the scene by whole pixels, so that its corner does not undo the random
    // shift.
    level = 0;
    zoom = 1;
    corner = glm::floor(glm::dvec2(low)) - bundle.shift;
    width = int(high.x - corner.x) + 2;  // a pixel more than needed, for the rounding to float
    height = int(high.y - corner.y) + 2;
    lowest = low.z;
    highest = high.z;
    if (windows.empty()) return;

    bounds.clear();
    auto addBounds = [&](int edges, const auto& vertexAt) {
        Rectangle r{projected[vertexAt(0)], projected[vertexAt(0)]};
        for (int k = 1; k < edges; ++k) {
            r.low = glm::min(r.low, projected[vertexAt(k)]);
            r.high = glm::max(r.high, projected[vertexAt(k)]);
        }
        bounds.push_back(r);
    };
    for (const Sheet& sheet : patches.sheets.sheets)
        addBounds(int(sheet.outline.size()), [&](int k) { return sheet.outline[size_t(k)][0]; });
    for (uint32_t i : patches.sheets.loose) {
        const Parent& parent = patches.parents[i];
        addBounds(parent.isTriangle ? 3 : 4, [&](int k) { return parent.vertex[size_t(k)]; });
    }
    // The shadows of the boxes do not depend on the shift, or lines near their borders would not be
    // uniform.
    openings.clear();
    for (const LineWindow& window : windows) {
        const glm::dvec3 middle(0.5f * (window.low + window.high));
        const glm::dvec3 half(0.5f * (window.high - window.low));
        const glm::dvec2 at(glm::dot(middle, frame.right), glm::dot(middle, frame.up));
        const glm::dvec2 reach(glm::dot(half, glm::abs(frame.right)),
                               glm::dot(half, glm::abs(frame.up)));
        openings.push_back({(at - reach) * perPixel, (at + reach) * perPixel});
    }
    findTaken(windows.size());
}

bool Rasteriser::lookThrough(size_t window) {
    level = windows[window].level;
    zoom = std::ldexp(1.0, level);
    // Other lines than those of the same pixels in other views.
    if (!patches.opacity.empty()) line = lineName(frame) + mixBits(window + 1);
    // The grid is shifted by the same length as the whole scene's: uniformly over its pixel too.
    const glm::dvec2 shift = glm::fract(frame.shift * zoom);
    // Pixels whose centres are in the opening.
    const glm::dvec2 first = glm::ceil(openings[window].low * zoom + shift - 0.5);
    const glm::dvec2 last = glm::ceil(openings[window].high * zoom + shift - 0.5);
    corner = first - shift;
    width = int(last.x - first.x);
    height = int(last.y - first.y);
    if (width <= 0 || height <= 0) return false;
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

bool Rasteriser::findPlane(const glm::vec3& origin, const glm::vec3& a, const glm::vec3& b,
                           Plane& plane) const {
    // In double from the world's coordinates, so that faces of different objects that coincide have
    // the same depth.
    const glm::dvec3 o(origin), da(a), db(b), normal = glm::cross(da, db);
    const double slant = glm::dot(normal, frame.direction);
    if (slant == 0) return false;
    const double size = double(pixelSize) / zoom;
    const glm::dvec2 first = (corner + 0.5) * size;  // the centre of pixel (0, 0), metres
    plane.dzdx = -glm::dot(normal, frame.right) / slant * size;
    plane.dzdy = -glm::dot(normal, frame.up) / slant * size;
    plane.z0 =
        glm::dot(normal, o) / slant + (corner.x + 0.5) * plane.dzdx + (corner.y + 0.5) * plane.dzdy;
    // (right, up, direction) is right-handed: the front faces against the direction where the
    // outline turns clockwise.
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
