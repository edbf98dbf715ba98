// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/rasteriser.h"

namespace raybundle {

Rasteriser::Rasteriser(const Patches& patches, float pixelSize, SmallPatches smallPatches)
    : patches(patches), pixelSize(pixelSize), smallPatches(smallPatches) {}

void Rasteriser::begin(const Bundle& bundle) {
    frame = bundle;
    if (smallPatches == SmallPatches::ROULETTE) roulette.begin(bundle);
    const size_t n = patches.vertices.size();
    projected.resize(n);
    depth.resize(n);
    const double perPixel = 1 / double(pixelSize);
    glm::dvec3 low(std::numeric_limits<double>::max()), high(-std::numeric_limits<double>::max());
    for (size_t v = 0; v < n; ++v) {
        const glm::dvec3 p(patches.vertices[v]);
        const glm::dvec3 q(glm::dot(p, frame.right) * perPixel, glm::dot(p, frame.up) * perPixel,
                           glm::dot(p, frame.direction));
        low = glm::min(low, q);
        high = glm::max(high, q);
        projected[v] = glm::dvec2(q);
        depth[v] = q.z;
    }
    // Move the window to the scene by whole pixels, so that its corner does not undo the random
    // shift.
    corner = glm::floor(glm::dvec2(low)) - bundle.shift;
    width = int(high.x - corner.x) + 2;  // a pixel more than needed, for the rounding to float
    height = int(high.y - corner.y) + 2;
    lowest = low.z;
    highest = high.z;
    for (glm::dvec2& q : projected) q -= corner;
}

bool Rasteriser::findPlane(const Parent& parent, DepthPlane& plane) const {
    // In double from the world's coordinates, so that faces of different objects that coincide have
    // the same depth.
    const glm::dvec3 normal = glm::cross(glm::dvec3(parent.a), glm::dvec3(parent.b));
    const double slant = glm::dot(normal, frame.direction);
    if (slant == 0) return false;
    plane.dzdx = -glm::dot(normal, frame.right) / slant * double(pixelSize);
    plane.dzdy = -glm::dot(normal, frame.up) / slant * double(pixelSize);
    plane.z0 = glm::dot(normal, glm::dvec3(parent.origin)) / slant + (corner.x + 0.5) * plane.dzdx +
               (corner.y + 0.5) * plane.dzdy;
    return true;
}

}  // namespace raybundle
