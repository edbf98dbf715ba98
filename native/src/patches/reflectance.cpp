// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/reflectance.h"

#include <algorithm>
#include <cmath>

#include "job/cancellation.h"

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

bool hasImage(const Mesh& mesh, int image) { return image >= 0 && !mesh.uvs.empty(); }

// Means over a patch of what a material's images and corner colours add or multiply.
struct Varying {
    glm::vec3 reflectance{0.0f};
    std::array<glm::vec3, 2> translucence{glm::vec3(0.0f), glm::vec3(0.0f)};
    std::array<glm::vec3, 2> emission{glm::vec3(0.0f), glm::vec3(0.0f)};
    float opacity = 1;
};

bool varies(const Mesh& mesh, const Material& m) {
    return hasImage(mesh, m.image) || hasImage(mesh, m.emissionImage) ||
           hasImage(mesh, m.translucenceImage) ||
           ((m.usesCornerColors || m.emissionUsesCornerColors) && !mesh.cornerColors.empty());
}

Varying varyingMeans(const Scene& scene, const Patches& patches, const Mesh& mesh,
                     const Material& material, uint32_t patch) {
    const Parent& parent = patches.parents[patches.parentOf[patch]];
    const Cell& cell = patches.cells[parent.cell];
    auto interpolate = [&](const auto& values, glm::vec3 point) {
        const std::array<float, 4> w = cell.weights(point);
        auto sum = w[0] * values[cell.corner[0]] + w[1] * values[cell.corner[1]] +
                   w[2] * values[cell.corner[2]];
        return cell.isTriangle() ? sum : sum + w[3] * values[cell.corner[3]];
    };
    const bool hasColors = !mesh.cornerColors.empty();

    int samples = kMinSamples;
    for (int index : {material.image, material.emissionImage, material.opacityImage,
                      material.translucenceImage}) {
        if (!hasImage(mesh, index)) continue;
        const Image& image = scene.images[size_t(index)];
        glm::vec2 low(INFINITY), high(-INFINITY);
        for (glm::vec2 uv : {glm::vec2(0.01f), glm::vec2(0.98f, 0.01f), glm::vec2(0.01f, 0.98f)}) {
            const glm::vec2 at = interpolate(mesh.uvs, patches.point(patch, uv));
            low = glm::min(low, at);
            high = glm::max(high, at);
        }
        const glm::vec2 pixels = (high - low) * glm::vec2(image.width, image.height);
        samples = int(std::clamp(std::max(pixels.x, pixels.y), float(samples), float(kMaxSamples)));
    }
    // A patch is sampled at the centroids of its own regular grid, so that linear colours are
    // exact.
    Parent grid;
    grid.isTriangle = parent.isTriangle;
    grid.countA = grid.countB = uint16_t(samples);
    const glm::vec2 centroid = parent.isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f);
    glm::vec3 image(0.0f), emissionImage(0.0f), translucenceImage(0.0f), color(0.0f);
    float opacity = 0;
    for (uint32_t k = 0; k < grid.patchCount(); ++k) {
        const glm::vec3 point = patches.point(patch, grid.pointOn(k, centroid));
        auto at = [&](int index) {
            return lookup(scene.images[size_t(index)], interpolate(mesh.uvs, point));
        };
        if (hasImage(mesh, material.image)) image += at(material.image);
        if (hasImage(mesh, material.emissionImage)) emissionImage += at(material.emissionImage);
        if (hasImage(mesh, material.translucenceImage))
            translucenceImage += at(material.translucenceImage);
        if (hasImage(mesh, material.opacityImage))
            opacity += glm::dot(at(material.opacityImage), glm::vec3(1.0f / 3));
        if (hasColors) color += interpolate(mesh.cornerColors, point);
    }
    const float perSample = 1 / float(grid.patchCount());
    Varying means;
    means.reflectance = perSample * material.imageWeight * image;
    if (material.usesCornerColors)
        means.reflectance += perSample * material.cornerColorWeight * color;
    for (size_t side = 0; side < 2; ++side) {
        means.emission[side] = perSample * material.emissionImageWeight[side] * emissionImage;
        means.translucence[side] =
            perSample * material.translucenceImageWeight[side] * translucenceImage;
        if (material.emissionUsesCornerColors)
            means.emission[side] += perSample * material.emissionColorWeight[side] * color;
    }
    if (hasImage(mesh, material.opacityImage)) means.opacity = perSample * opacity;
    return means;
}

}  // namespace

bool isEmptySpace(const Material& m) {
    constexpr glm::vec3 kBlack(0.0f);
    return m.reflectance[0] == kBlack && m.reflectance[1] == kBlack && m.emission[0] == kBlack &&
           m.emission[1] == kBlack && m.image < 0 && m.emissionImage < 0 && !m.usesCornerColors &&
           !m.emissionUsesCornerColors && !m.isTranslucent();
}

void assignOpacity(const Scene& scene, Patches& patches) {
    // What reflects or shines but stops no light would never be met by a line: it stops so much.
    constexpr float kLeastOpacity = 1.0f / 64;
    // Keeps areas above zero, by which much is divided.
    constexpr float kLeastArea = 1e-4f;
    auto materialOf = [&](const Parent& parent) -> const Material& {
        return scene.materialOf(parent.instance, size_t(parent.face));
    };
    if (std::all_of(patches.parents.begin(), patches.parents.end(),
                    [&](const Parent& parent) { return materialOf(parent).isOpaque(); }))
        return;
    patches.opacity.assign(patches.count(), 1.0f);
    parallelFor(size_t(0), patches.parents.size(), [&](size_t i) {
        Parent& parent = patches.parents[i];
        const Material& material = materialOf(parent);
        if (material.isOpaque()) return;
        const Mesh& mesh = scene.meshes[scene.instances[parent.instance].mesh];
        const float least = isEmptySpace(material) ? 0.0f : kLeastOpacity;
        // Light gets in.
        parent.isSolid = false;
        for (uint32_t p = parent.firstPatch; p < parent.firstPatch + parent.patchCount(); ++p) {
            float opacity = material.opacity;
            if (hasImage(mesh, material.opacityImage))
                opacity *= varyingMeans(scene, patches, mesh, material, p).opacity;
            patches.opacity[p] = std::clamp(opacity, least, 1.0f);
            patches.area[p] *= std::max(patches.opacity[p], kLeastArea);
        }
    });
}

namespace {

void assignScattering(const Scene& scene, Patches& patches) {
    patches.scattering.clear();
    if (std::all_of(scene.materials.begin(), scene.materials.end(), [](const Material& material) {
            return material.scattering[0].isLambert() && material.scattering[1].isLambert();
        }))
        return;
    for (const Material& material : scene.materials)
        patches.scattering.insert(patches.scattering.end(), material.scattering.begin(),
                                  material.scattering.end());
    const uint32_t ofDefault = uint32_t(scene.materials.size());
    patches.scattering.resize(patches.scattering.size() + 2);
    for (Parent& parent : patches.parents) {
        const Mesh& mesh = scene.meshes[scene.instances[parent.instance].mesh];
        const int32_t material = mesh.faceMaterials[size_t(parent.face)];
        parent.scattering = material < 0 ? ofDefault : uint32_t(material);
    }
}

}  // namespace

void assignMaterials(const Scene& scene, Patches& patches) {
    patches.reflectance.resize(patches.sideCount());
    patches.emission.resize(patches.sideCount());
    const std::array<AngleFactors, 2> none{};
    const bool hasAngles =
        std::any_of(scene.materials.begin(), scene.materials.end(),
                    [&](const Material& material) { return material.reflectanceByAngle != none; });
    patches.byAngle.assign(hasAngles ? patches.sideCount() : 0, AngleFactors{});
    const bool hasTranslucence =
        std::any_of(scene.materials.begin(), scene.materials.end(),
                    [](const Material& material) { return material.isTranslucent(); });
    patches.translucence.assign(hasTranslucence ? patches.sideCount() : 0, glm::vec3(0.0f));
    assignScattering(scene, patches);
    parallelFor(size_t(0), patches.parents.size(), [&](size_t i) {
        const Parent& parent = patches.parents[i];
        const Mesh& mesh = scene.meshes[scene.instances[parent.instance].mesh];
        const Material& material = scene.materialOf(mesh, parent.face);
        const bool isVarying = varies(mesh, material);
        for (uint32_t p = parent.firstPatch; p < parent.firstPatch + parent.patchCount(); ++p) {
            Varying varying;
            if (isVarying) varying = varyingMeans(scene, patches, mesh, material, p);
            // The material's values are of the whole patch, a patch's of its opaque share.
            const float opacity = patches.opacityOf(p);
            const float scale = opacity > 0 ? 1 / opacity : 0.0f;
            for (size_t side = 0; side < 2; ++side) {
                patches.reflectance[2 * p + side] =
                    glm::clamp(scale * (material.reflectance[side] + varying.reflectance), 0.0f,
                               kMaxReflectance);
                for (size_t term = 0; hasAngles && term < material.reflectanceByAngle[side].size();
                     ++term)
                    patches.byAngle[2 * p + side][term] =
                        scale * material.reflectanceByAngle[side][term];
                if (hasTranslucence)
                    patches.translucence[2 * p + side] = glm::clamp(
                        scale * (material.translucence[side] + varying.translucence[side]),
                        glm::vec3(0.0f), kMaxReflectance - patches.reflectance[2 * p + side]);
                patches.emission[2 * p + side] =
                    scale *
                    glm::max(material.emission[side] + varying.emission[side], glm::vec3(0.0f));
            }
        }
    });
}

std::vector<glm::vec3> diffuseReflectances(const Scene& scene, const Patches& patches) {
    std::vector<glm::vec3> diffuse(patches.sideCount());
    parallelFor(size_t(0), patches.parents.size(), [&](size_t i) {
        const Parent& parent = patches.parents[i];
        const Material& material = scene.materialOf(parent.instance, size_t(parent.face));
        const uint32_t first = 2 * parent.firstPatch;
        for (uint32_t side = first; side < first + 2 * parent.patchCount(); ++side) {
            const glm::vec3 all = patches.opacityOf(side / 2) * patches.reflectance[side];
            diffuse[side] =
                glm::clamp(material.diffuseScale[side % 2] * all + material.diffuseOffset[side % 2],
                           0.0f, 1.0f);
        }
    });
    return diffuse;
}

}  // namespace raybundle
