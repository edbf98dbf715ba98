// SPDX-License-Identifier: GPL-3.0-or-later
#include "stated_error/stated_error.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <iomanip>
#include <optional>
#include <sstream>

#include "job/cancellation.h"
#include "patches/neighbours.h"
#include "stated_error/object_noise.h"
#include "stated_error/surplus.h"

namespace raybundle {
namespace {

// A mesh is too coarse where its share of the error is above this, and above so many targets.
constexpr double kCoarse = 0.05, kCoarseTargets = 2;
// Objects that are named for it.
constexpr size_t kMostNamed = 6;
// An object is noisy above so many targets, unless it is kNearlyBlack: a room beside a sunny plain
// is not.
constexpr double kNoisyTargets = 2;
// Objects darker than this share of the mean square light are not worth a finer mesh.
constexpr double kDark = 0.01;
// An object of whose area less than this is known takes over the surplus of the others.
constexpr double kKnownShare = 0.3;

// Squares summed over RGB times exposed area, (W/m^2)^2 m^2.
struct Squares {
    double signal = 0, noise = 0, residual = 0;
    double shown = 0;     // signal at the corners, which have less of what is narrower than a face
    double ripple = 0;    // of the noise: what interpolation between the corners cannot follow
    double gathered = 0;  // noise of what corners gather, beside that of bundles
    double smooth = 0, step = 0, known = 0;  // of the patches whose surplus is known; their signal
    double knownArea = 0, area = 0, cellArea = 0, patches = 0, cells = 0;

    void add(const Squares& o) {
        signal += o.signal;
        shown += o.shown;
        noise += o.noise;
        residual += o.residual;
        ripple += o.ripple;
        gathered += o.gathered;
        smooth += o.smooth;
        step += o.step;
        known += o.known;
        knownArea += o.knownArea;
        area += o.area;
    }
    // The residual without the noise in it.
    double mesh(double noiseScale) const { return std::max(0.0, residual - noiseScale * ripple); }
    // The surplus over the signal, squares; by chance steps may be below zero.
    double smoothShare() const { return known > 0 ? smooth / known : 0; }
    double stepShare() const { return known > 0 ? std::max(step, 0.0) / known : 0; }
};

std::string inPercent(double share) {
    std::ostringstream text;
    text << std::setprecision(2) << 100 * share << " %";
    return text.str();
}

std::string inMetres(double length) {
    std::ostringstream text;
    text << std::setprecision(2) << length << " m";
    return text.str();
}

// Of one instance: adds up the squares, and notes the square of the error at each corner.
class InstanceErrors {
  public:
    InstanceErrors(const Instance& instance, const Tiles& tiles, const InstanceRange& range,
                   const SideErrors& sides, const InstanceLight& light)
        : instance(instance),
          tiles(tiles),
          patches(tiles.patches()),
          range(range),
          side(uint32_t(instance.side)),
          sides(sides),
          isGathered(light.gatheredNoise.has_value()),
          light(light),
          surplus(surplusOf({patches, sides.exposed}, range.firstParent, range.lastParent,
                            instance.side, sides.irradiance, sides.directError)) {
        std::vector<double> exposed(range.lastCell - range.firstCell, 0.0);  // per cell, m^2
        forEachPatch([&](uint32_t at, double weight, const Cell& cell, const auto&, double residual,
                         const Surplus& s) {
            exposed[size_t(&cell - &patches.cells[range.firstCell])] += weight;
            const double signal = weight * square(lightAt(at));
            sum.area += weight;
            sum.signal += signal;
            sum.noise += weight * noiseAt(at);
            sum.residual += weight * residual;
            ++sum.patches;
            if (!s.isKnown) return;
            sum.smooth += weight * double(s.smooth);
            sum.step += weight * double(s.step);
            sum.known += signal;
            sum.knownArea += weight;
        });
        for (uint32_t c = range.firstCell; c < range.lastCell; ++c) {
            throwIfCancelledAt(c);
            const Cell& cell = patches.cells[c];
            const double share = exposed[c - range.firstCell] / cell.cornerCount();
            for (int32_t corner : cell.corner)
                if (corner >= 0)
                    sum.shown += share * square(light.direct[size_t(corner)] +
                                                light.indirect[size_t(corner)]);
            if (!instance.hasResultOnFace(size_t(cell.face))) continue;
            ++sum.cells;
            // Of the parallelogram of which a triangle is half: the square of about an edge.
            sum.cellArea += double(glm::length(glm::cross(cell.a, cell.b)));
            corners += cell.isTriangle() ? 0.5 : 1.0;
        }
        if (isGathered)
            sum.gathered = std::pow(double(*light.gatheredNoise), 2) * sum.shown;
        else
            sum.ripple = sum.noise * rippleShare();
    }

    const Squares& squares() const { return sum; }

    // RMS error around each corner, as radiance, W/(m^2 sr). noiseScale: of the squares.
    // unknownShare: surplus over signal, squares, where there are too few patches around.
    std::vector<float> perCorner(size_t corners, double noiseScale, double unknownShare) const {
        std::vector<double> squares(corners, 0), weights(corners, 0);
        const double ripple = sum.noise > 0 ? sum.ripple / sum.noise : 0;
        forEachPatch([&](uint32_t at, double weight, const Cell& cell,
                         const std::array<float, 4>& w, double residual, const Surplus& s) {
            const double beyond = s.isKnown ? double(s.smooth + std::max(s.step, 0.0f))
                                            : unknownShare * square(lightAt(at));
            const double noise =
                noiseScale * noiseAt(at) +
                (isGathered ? std::pow(double(*this->light.gatheredNoise), 2) * square(lightAt(at))
                            : 0.0);
            const double mesh = std::max(0.0, residual - ripple * noise);
            const double error = mesh + noise + beyond;
            for (int k = 0; k < 4; ++k)
                if (cell.corner[k] >= 0) {
                    squares[size_t(cell.corner[k])] += weight * double(w[k]) * error;
                    weights[size_t(cell.corner[k])] += weight * double(w[k]);
                }
        });
        std::vector<float> result(corners, 0.0f);
        for (size_t c = 0; c < corners; ++c)
            if (weights[c] > 0)
                result[c] = float(std::sqrt(squares[c] / weights[c] / 3) / glm::pi<double>());
        return result;
    }

  private:
    static double square(const glm::vec3& v) { return double(glm::dot(v, v)); }
    glm::vec3 lightAt(uint32_t at) const { return sides.irradiance.all(at); }
    bool hasResult(uint32_t at) const {
        return instance.hasResultOnFace(size_t(patches.parentAt(at).face));
    }
    double noiseAt(uint32_t at) const {
        if (sides.noise.empty()) return 0;
        return square(sides.noise[at]) + 3 * double(sides.directError[at] * sides.directError[at]);
    }

    // The share of the noise that differs from patch to patch, less what the corners can follow.
    double rippleShare() const {
        if (sides.noise.empty()) return 0;
        double rough = 0, all = 0;
        for (const TilePair& pair :
             neighbouringTiles(patches, range.firstParent, range.lastParent)) {
            const uint32_t a = 2 * pair.first + side, b = 2 * pair.second + side;
            if (!hasResult(a) || !hasResult(b)) continue;
            const double direct =
                noiseAt(a) - square(sides.noise[a]) + noiseAt(b) - square(sides.noise[b]);
            rough += 0.5 * (square(sides.noise[a] - sides.noise[b]) + direct);
            all += 0.5 * (noiseAt(a) + noiseAt(b));
        }
        const double unfollowed = std::max(0.0, 1 - corners / std::max(1.0, sum.patches));
        return all > 0 ? std::min(1.0, rough / all) * unfollowed : 0;
    }

    // body(side, exposed area, cell, corner weights at its middle, square of the residual, surplus)
    template <class Body>
    void forEachPatch(const Body& body) const {
        const uint32_t first = range.firstParent < range.lastParent
                                   ? patches.parents[range.firstParent].firstPatch
                                   : 0;
        for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
            throwIfCancelledAt(p);
            const Parent& parent = patches.parents[p];
            const Cell& cell = patches.cells[parent.cell];
            if (!instance.hasResultOnFace(size_t(parent.face))) continue;
            const glm::vec2 middle = parent.isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f);
            for (uint32_t k = 0; k < parent.patchCount(); ++k) {
                const uint32_t patch = parent.firstPatch + k, at = 2 * patch + side;
                const double weight = double(patches.area[patch] * sides.exposed[at]);
                // The mean of the interpolation over the patch is its value in the middle.
                const auto w = cell.weights(parent.position(parent.pointOn(k, middle)));
                glm::vec3 shown(0.0f);
                for (int c = 0; c < 4; ++c)
                    if (cell.corner[c] >= 0)
                        shown += w[c] * (light.direct[size_t(cell.corner[c])] +
                                         light.indirect[size_t(cell.corner[c])]);
                // What the patches of a cut tile have of its surplus is known, but nothing between
                // the corners follows it: no face is smaller than a tile.
                Surplus beyond = surplus[patch - first];
                beyond.smooth = std::ldexp(beyond.smooth, -4 * tiles.level(patch));
                beyond.step = std::ldexp(beyond.step, -tiles.level(patch));
                const Surplus& whole = surplus[patch - first];
                const double known = double(whole.smooth - beyond.smooth) +
                                     std::max(0.0, double(whole.step - beyond.step));
                if (isGathered)
                    body(at, weight, cell, w, 0.0, Surplus{true, 0, 0});
                else
                    body(at, weight, cell, w, square(shown - lightAt(at)) + known, beyond);
            }
        }
    }

    const Instance& instance;
    const Tiles& tiles;
    const Patches& patches;  // a tile each
    const InstanceRange& range;
    const uint32_t side;
    const SideErrors& sides;
    const bool isGathered;
    const InstanceLight& light;
    const std::vector<Surplus> surplus;
    Squares sum;
    double corners = 0;  // about, of the cells with a result
};

// noise: at the corners, by that of the patches, relative.
Report::Errors relative(const Squares& s, double noiseScale, double noise, double discretisation) {
    if (!(s.signal > 0)) return {};
    return {std::hypot(noise, s.shown > 0 ? std::sqrt(s.gathered / s.shown) : 0),
            std::sqrt(discretisation), std::sqrt(s.mesh(noiseScale) / s.signal),
            std::sqrt(noiseScale * s.noise / s.signal)};
}

// The edge at which the mesh's error would be `limit`: that of smooth light falls with its square,
// that of steps with its root.
double edgeFor(double limit, double smoothShare, double stepShare, double patchEdge) {
    double low = 0, high = 1e6;
    for (int k = 0; k < 60; ++k) {
        const double ratio = std::sqrt(std::max(low, 1e-6) * high);
        const double error = smoothShare * std::pow(ratio, 4) + stepShare * ratio;
        (error > limit * limit ? high : low) = ratio;
    }
    return low * patchEdge;
}

// Names the noisiest. noises: of those that have too much, relative, with their names.
void warnOfNoise(std::vector<std::pair<double, std::string>> noises, double target,
                 bool isOutOfReach, Report& report) {
    if (noises.empty()) return;
    std::stable_sort(noises.begin(), noises.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    const size_t named = std::min(noises.size(), kMostNamed);
    std::string text = "noisier than twice the target of " + inPercent(target) + ":";
    for (size_t k = 0; k < named; ++k)
        text += (k > 0 ? ", \"" : " object \"") + noises[k].second + "\" (" +
                inPercent(noises[k].first) + ")";
    if (noises.size() > named)
        text += " and " + std::to_string(noises.size() - named) +
                " more, of which the report has the noise of each";
    report.warn(
        WarningId::NOISY_OBJECTS,
        text + (isOutOfReach ? "; few lines bring them light: a lower target_error takes long "
                               "and gains little there"
                             : "; lower target_error"));
}

// A mesh that is too coarse: its squared error, and what to say of it.
using CoarseMesh = std::pair<double, std::string>;

std::optional<CoarseMesh> coarseMesh(const std::string& name, const Squares& s, double noiseScale,
                                     double limit, double smoothShare, double stepShare) {
    const double mesh = std::sqrt(s.mesh(noiseScale) / s.signal);
    if (mesh <= limit || s.cells == 0) return std::nullopt;
    const double faceEdge = std::sqrt(s.cellArea / s.cells);
    const double patchEdge = std::sqrt(s.area / s.patches);
    const double edge = std::min(edgeFor(limit, smoothShare, stepShare, patchEdge), 0.5 * faceEdge);
    return CoarseMesh{
        s.mesh(noiseScale),
        "object \"" + name + "\": its faces, " + inMetres(faceEdge) +
            " wide in the mean, are too coarse for its light: interpolated over them it is " +
            inPercent(mesh) + " off. Edges of about " + inMetres(edge) + " would bring that to " +
            inPercent(limit) +
            ": subdivide the mesh, or choose the topology SUBDIVIDE with patch_size " +
            inMetres(0.5 * edge)};
}

// Names those whose error is largest.
void warnOf(std::vector<CoarseMesh> meshes, Report& report) {
    std::stable_sort(meshes.begin(), meshes.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    const size_t named = std::min(meshes.size(), kMostNamed);
    for (size_t k = 0; k < named; ++k)
        report.warn(WarningId::COARSE_MESH, std::move(meshes[k].second));
    if (meshes.size() > named)
        report.warn(WarningId::COARSE_MESH,
                    std::to_string(meshes.size() - named) +
                        " more objects are too coarse for their light: the report has "
                        "the error of each");
}

}  // namespace

void stateErrors(const Scene& scene, const Tiles& tiles, const std::vector<InstanceRange>& ranges,
                 const SideErrors& sides, const Settings& settings,
                 std::vector<InstanceLight>& light, Report& report) {
    const double targetError = double(settings.targetError);
    const bool errsAlike = settings.hasIndependentDirections();
    std::vector<std::optional<InstanceErrors>> errors(light.size());
    parallelFor(size_t(0), light.size(), [&](size_t i) {
        if (light[i].isBaked)
            errors[i].emplace(scene.instances[i], tiles, ranges[i], sides, light[i]);
    });
    Squares all;
    for (const auto& e : errors)
        if (e) all.add(e->squares());
    for (InstanceLight& baked : light) baked.error.assign(baked.direct.size(), 0.0f);
    if (!(all.signal > 0)) return;

    // Also what the halves have in common.
    const double noiseScale =
        all.noise > 0 ? report.estimatedError * report.estimatedError * all.signal / all.noise : 0;
    const double shown = report.error.noise;  // as the bake has measured it at all corners
    const double limit = std::max(kCoarse, kCoarseTargets * targetError);
    double discretisation = 0;
    std::vector<CoarseMesh> coarse;
    std::vector<std::pair<double, std::string>> noisy;
    for (size_t i = 0; i < light.size(); ++i) {
        throwIfCancelledAt(i);
        if (!errors[i]) continue;
        const Squares& own = errors[i]->squares();
        const Squares& known = own.knownArea >= kKnownShare * own.area ? own : all;
        const double smooth = known.smoothShare(), step = known.stepShare();
        discretisation += (smooth + step) * own.signal / all.signal;
        // What corners gather is the light of many patches, wherever these are.
        const double ofPatches =
            light[i].gatheredNoise ? shown : std::max(sides.ofObjects[i], errsAlike ? shown : 0);
        report.objects[i].error = relative(own, noiseScale, ofPatches, smooth + step);
        light[i].error = errors[i]->perCorner(light[i].direct.size(), noiseScale, smooth + step);
        const double noise = report.objects[i].error.noise;
        const double brightness = own.signal / own.area * all.area / all.signal;
        if (!errsAlike && noise > kNoisyTargets * targetError &&
            brightness > kNearlyBlack * kNearlyBlack)
            noisy.push_back({noise, light[i].name});
        if (!(brightness > kDark)) continue;
        if (auto mesh = coarseMesh(light[i].name, own, noiseScale, limit, smooth, step))
            coarse.push_back(std::move(*mesh));
    }
    warnOfNoise(std::move(noisy), targetError, sides.isOutOfReach, report);
    warnOf(std::move(coarse), report);
    report.error = relative(all, noiseScale, shown, discretisation);
    report.error.ofPatches = report.estimatedError;
}

}  // namespace raybundle
