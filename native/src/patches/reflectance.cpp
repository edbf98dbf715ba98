// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/reflectance.h"

#include <algorithm>
#include <cmath>

#include "job/cancellation.h"
#include "patches/side.h"

namespace raybundle {
namespace {

constexpr float kMaxReflectance = 0.999f;
// Samples along each edge of a patch: one per pixel of the image, but at least kMinSamples and at
// most kMaxSamples.
constexpr int kMinSamples = 3;
constexpr int kMaxSamples = 32;

// Returns a pixel by its column and row, which may lie outside the image.
glm::vec3 texel(const Image& image, int x, int y) {
    auto wrap = [&](int i, int n) {
        if (image.extension == RB_IMAGE_REPEAT) return ((i % n) + n) % n;
        return i < 0 || i >= n ? (image.extension == RB_IMAGE_CLIP ? -1 : std::clamp(i, 0, n - 1))
                               : i;
    };
    const int wx = wrap(x, image.width), wy = wrap(y, image.height);
    return wx < 0 || wy < 0 ? glm::vec3(0.0f) : image.pixels[size_t(wy) * image.width + wx];
}

// Returns the image at `uv` by bilinear interpolation, which is Blender's default.
glm::vec3 lookup(const Image& image, glm::vec2 uv) {
    const float x = uv.x * image.width - 0.5f, y = uv.y * image.height - 0.5f;
    if (!(std::abs(x) < 1e9f) || !(std::abs(y) < 1e9f)) return glm::vec3(0.0f);
    const int x0 = int(std::floor(x)), y0 = int(std::floor(y));
    const float fx = x - x0, fy = y - y0;
    return (1 - fy) * ((1 - fx) * texel(image, x0, y0) + fx * texel(image, x0 + 1, y0)) +
           fy * ((1 - fx) * texel(image, x0, y0 + 1) + fx * texel(image, x0 + 1, y0 + 1));
}

// Returns whether a mesh has UVs at which to read an image. `image` may be RB_NO_IMAGE.
bool hasImage(const Mesh& mesh, int image) { return image >= 0 && !mesh.uvs.empty(); }

// Means over a patch of the images and corner colours of a material: what they add to the
// constants, and the factor of the opacity.
struct Varying {
    struct Side {
        glm::vec3 reflectance{0.0f}, emission{0.0f}, translucence{0.0f};
    };
    std::array<Side, 2> sides;
    float opacity = 1;
};

// Returns whether images or corner colours change the colours of a material on a mesh.
bool varies(const Mesh& mesh, const Material& material) {
    for (const MaterialSide& side : material.sides)
        for (const SurfaceColor* color : side.colors())
            if (hasImage(mesh, color->image) ||
                (color->usesCornerColors() && !mesh.cornerColors.empty()))
                return true;
    return false;
}

// An image that a material uses, and the sum of its samples.
struct ReadImage {
    int index;
    glm::vec3 sum{0.0f};
};

// Returns the images of a material, each once although several colours may use it.
std::vector<ReadImage> imagesOf(const Mesh& mesh, const Material& material) {
    std::vector<ReadImage> images;
    auto add = [&](int index) {
        if (hasImage(mesh, index) &&
            std::none_of(images.begin(), images.end(),
                         [&](const ReadImage& image) { return image.index == index; }))
            images.push_back({index});
    };
    for (const MaterialSide& side : material.sides)
        for (const SurfaceColor* color : side.colors()) add(color->image);
    add(material.opacityImage);
    return images;
}

// Returns the means over a patch.
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
    std::vector<ReadImage> images = imagesOf(mesh, material);

    int samples = kMinSamples;
    for (const ReadImage& read : images) {
        const Image& image = scene.images[size_t(read.index)];
        glm::vec2 low(INFINITY), high(-INFINITY);
        for (glm::vec2 uv : {glm::vec2(0.01f), glm::vec2(0.98f, 0.01f), glm::vec2(0.01f, 0.98f)}) {
            const glm::vec2 at = interpolate(mesh.uvs, patches.point(patch, uv));
            low = glm::min(low, at);
            high = glm::max(high, at);
        }
        const glm::vec2 pixels = (high - low) * glm::vec2(image.width, image.height);
        samples = int(std::clamp(std::max(pixels.x, pixels.y), float(samples), float(kMaxSamples)));
    }
    // Sample the patch at the centroids of a regular grid, so that the means of linear colours are
    // exact.
    Parent grid;
    grid.isTriangle = parent.isTriangle;
    grid.countA = grid.countB = uint16_t(samples);
    const glm::vec2 centroid = parent.isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f);
    glm::vec3 colors(0.0f);
    float opacity = 0;
    for (uint32_t k = 0; k < grid.patchCount(); ++k) {
        const glm::vec3 point = patches.point(patch, grid.pointOn(k, centroid));
        for (ReadImage& read : images) {
            const glm::vec3 value =
                lookup(scene.images[size_t(read.index)], interpolate(mesh.uvs, point));
            read.sum += value;
            if (read.index == material.opacityImage)
                opacity += glm::dot(value, glm::vec3(1.0f / 3));
        }
        if (hasColors) colors += interpolate(mesh.cornerColors, point);
    }
    const float perSample = 1 / float(grid.patchCount());
    auto mean = [&](const SurfaceColor& color) {
        glm::vec3 sum(0.0f);
        for (const ReadImage& read : images)
            if (read.index == color.image) sum = perSample * color.imageWeight * read.sum;
        if (color.usesCornerColors()) sum += perSample * color.cornerColorWeight * colors;
        return sum;
    };
    Varying means;
    for (size_t side = 0; side < 2; ++side) {
        const MaterialSide& surface = material.sides[side];
        means.sides[side] = {mean(surface.reflectance), mean(surface.emission),
                             mean(surface.translucence)};
    }
    if (hasImage(mesh, material.opacityImage)) means.opacity = perSample * opacity;
    return means;
}

}  // namespace

bool isEmptySpace(const Material& material) {
    return material.sides[0].reflectance.isBlack() && material.sides[1].reflectance.isBlack() &&
           !material.emits() && !material.isTranslucent();
}

void assignOpacity(const Scene& scene, Patches& patches) {
    // The least opacity of a surface that reflects or emits: no line would meet a surface that
    // stops no light.
    constexpr float kLeastOpacity = 1.0f / 64;
    // Keeps areas above 0, since many quantities are divided by them.
    constexpr float kLeastArea = 1e-4f;
    auto materialOf = [&](const Parent& parent) -> const Material& {
        return scene.materialOf(parent.instance, size_t(parent.face));
    };
    if (std::all_of(scene.materials.begin(), scene.materials.end(),
                    [](const Material& material) { return material.isOpaque(); }) ||
        std::all_of(patches.parents.begin(), patches.parents.end(),
                    [&](const Parent& parent) { return materialOf(parent).isOpaque(); }))
        return;
    patches.opacity.assign(patches.count(), 1.0f);
    parallelFor(size_t(0), patches.parents.size(), [&](size_t i) {
        Parent& parent = patches.parents[i];
        const Material& material = materialOf(parent);
        if (material.isOpaque()) return;
        const Mesh& mesh = scene.meshes[scene.instances[parent.instance].mesh];
        const float least = isEmptySpace(material) ? 0.0f : kLeastOpacity;
        // Light enters a surface that is not opaque, so that it encloses no dark volume.
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

// Sets the scattering of all materials, and the index of each parent.
void assignScattering(const Scene& scene, Patches& patches) {
    patches.scattering.clear();
    if (std::all_of(scene.materials.begin(), scene.materials.end(), [](const Material& material) {
            return material.sides[0].scattering.isLambert() &&
                   material.sides[1].scattering.isLambert();
        }))
        return;
    for (const Material& material : scene.materials)
        for (const MaterialSide& side : material.sides)
            patches.scattering.push_back(side.scattering);
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
    const bool hasAngles =
        std::any_of(scene.materials.begin(), scene.materials.end(), [](const Material& material) {
            return material.sides[0].reflectanceByAngle != AngleFactors{} ||
                   material.sides[1].reflectanceByAngle != AngleFactors{};
        });
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
            // The values of the material are relative to the whole patch, those of a patch to its
            // opaque share.
            const float opacity = patches.opacityOf(p);
            const float scale = opacity > 0 ? 1 / opacity : 0.0f;
            for (size_t side = 0; side < 2; ++side) {
                const MaterialSide& surface = material.sides[side];
                const Varying::Side& more = varying.sides[side];
                patches.reflectance[2 * p + side] =
                    glm::clamp(scale * (surface.reflectance.constant + more.reflectance), 0.0f,
                               kMaxReflectance);
                for (size_t term = 0; hasAngles && term < surface.reflectanceByAngle.size(); ++term)
                    patches.byAngle[2 * p + side][term] = scale * surface.reflectanceByAngle[term];
                if (hasTranslucence)
                    patches.translucence[2 * p + side] = glm::clamp(
                        scale * (surface.translucence.constant + more.translucence),
                        glm::vec3(0.0f), kMaxReflectance - patches.reflectance[2 * p + side]);
                patches.emission[2 * p + side] =
                    scale * glm::max(surface.emission.constant + more.emission, glm::vec3(0.0f));
            }
        }
    });
}

glm::vec3 diffuseReflectance(const Scene& scene, const Patches& patches, uint32_t side) {
    const Parent& parent = patches.parentAt(side);
    const MaterialSide& surface =
        scene.materialOf(parent.instance, size_t(parent.face)).sides[isBack(side)];
    const glm::vec3 all = patches.opacityOf(patchOf(side)) * patches.reflectance[side];
    return glm::clamp(surface.colorScale * all + surface.colorOffset, 0.0f, 1.0f);
}

std::vector<glm::vec3> diffuseReflectances(const Scene& scene, const Patches& patches) {
    std::vector<glm::vec3> diffuse(patches.sideCount());
    parallelFor(uint32_t(0), uint32_t(diffuse.size()),
                [&](uint32_t side) { diffuse[side] = diffuseReflectance(scene, patches, side); });
    return diffuse;
}

}  // namespace raybundle
