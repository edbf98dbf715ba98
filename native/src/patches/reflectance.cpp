// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/reflectance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace raybundle {
namespace {

constexpr float kMaxReflectance = 0.999f;
// Samples along each edge of a patch: at least kMinSamples, at most kMaxSamples, else one per
// pixel.
constexpr int kMinSamples = 3;
constexpr int kMaxSamples = 32;

glm::vec3 texel(const Image& image, int x, int y) {
    auto wrap = [&](int i, int n) {
        if (image.extension == RB_IMAGE_REPEAT) return ((i % n) + n) % n;
        return i < 0 || i >= n ? (image.extension == RB_IMAGE_CLIP ? -1 : std::clamp(i, 0, n - 1))
                               : i;
    };
    const int wx = wrap(x, image.width), wy = wrap(y, image.height);
    return wx < 0 || wy < 0 ? glm::vec3(0.0f) : image.pixels[size_t(wy) * image.width + wx];
}

// Bilinear lookup, as Blender's default interpolation.
glm::vec3 lookup(const Image& image, glm::vec2 uv) {
    const float x = uv.x * image.width - 0.5f, y = uv.y * image.height - 0.5f;
    if (!(std::abs(x) < 1e9f) || !(std::abs(y) < 1e9f)) return glm::vec3(0.0f);
    const int x0 = int(std::floor(x)), y0 = int(std::floor(y));
    const float fx = x - x0, fy = y - y0;
    return (1 - fy) * ((1 - fx) * texel(image, x0, y0) + fx * texel(image, x0 + 1, y0)) +
           fy * ((1 - fx) * texel(image, x0, y0 + 1) + fx * texel(image, x0 + 1, y0 + 1));
}

// Mean of the image and of the corner colours over a patch, as far as the material uses them.
glm::vec3 varyingReflectance(const Scene& scene, const Patches& patches, const Mesh& mesh,
                             const Material& material, uint32_t patch) {
    const Parent& parent = patches.parents[patches.parentOf[patch]];
    const Cell& cell = patches.cells[parent.cell];
    auto interpolate = [&](const auto& values, glm::vec3 point) {
        const std::array<float, 4> w = cell.weights(point);
        auto sum = w[0] * values[cell.corner[0]] + w[1] * values[cell.corner[1]] +
                   w[2] * values[cell.corner[2]];
        return cell.isTriangle() ? sum : sum + w[3] * values[cell.corner[3]];
    };
    const bool hasImage = material.image >= 0 && !mesh.uvs.empty();
    const bool hasColors = material.usesCornerColors && !mesh.cornerColors.empty();

    int samples = kMinSamples;
    if (hasImage) {
        const Image& image = scene.images[material.image];
        glm::vec2 low(INFINITY), high(-INFINITY);
        for (glm::vec2 uv : {glm::vec2(0.01f), glm::vec2(0.98f, 0.01f), glm::vec2(0.01f, 0.98f)}) {
            const glm::vec2 at = interpolate(mesh.uvs, patches.point(patch, uv));
            low = glm::min(low, at);
            high = glm::max(high, at);
        }
        const glm::vec2 pixels = (high - low) * glm::vec2(image.width, image.height);
        samples =
            int(std::clamp(std::max(pixels.x, pixels.y), float(kMinSamples), float(kMaxSamples)));
    }
    // A patch is sampled at the centroids of its own regular grid, so that linear colours are
    // exact.
    Parent grid;
    grid.isTriangle = parent.isTriangle;
    grid.countA = grid.countB = uint16_t(samples);
    const glm::vec2 centroid = parent.isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f);
    glm::vec3 sum(0.0f);
    for (uint32_t k = 0; k < grid.patchCount(); ++k) {
        const glm::vec3 point = patches.point(patch, grid.pointOn(k, centroid));
        if (hasImage)
            sum += material.imageWeight *
                   lookup(scene.images[material.image], interpolate(mesh.uvs, point));
        if (hasColors) sum += material.cornerColorWeight * interpolate(mesh.cornerColors, point);
    }
    return sum / float(samples * samples);
}

}  // namespace

void assignMaterials(const Scene& scene, Patches& patches) {
    patches.reflectance.resize(patches.sideCount());
    patches.emission.resize(patches.sideCount());
    tbb::parallel_for(size_t(0), patches.parents.size(), [&](size_t i) {
        const Parent& parent = patches.parents[i];
        const Mesh& mesh = scene.meshes[scene.instances[parent.instance].mesh];
        const Material& material = scene.materialOf(mesh, parent.face);
        const bool varies = (material.image >= 0 && !mesh.uvs.empty()) ||
                            (material.usesCornerColors && !mesh.cornerColors.empty());
        for (uint32_t p = parent.firstPatch; p < parent.firstPatch + parent.patchCount(); ++p) {
            const glm::vec3 varying =
                varies ? varyingReflectance(scene, patches, mesh, material, p) : glm::vec3(0.0f);
            for (int side = 0; side < 2; ++side) {
                patches.reflectance[2 * p + side] =
                    glm::clamp(material.reflectance[side] + varying, 0.0f, kMaxReflectance);
                patches.emission[2 * p + side] = material.emission[side];
            }
        }
    });
}

}  // namespace raybundle
