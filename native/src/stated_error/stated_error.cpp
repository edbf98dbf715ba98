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
#include "stated_error/dense_surplus.h"
#include "stated_error/object_noise.h"
#include "stated_error/surplus.h"

namespace raybundle {
namespace {

// A mesh is too coarse if the part `mesh` of its stated error is above both kCoarse and
// kCoarseTargets times the target.
constexpr double kCoarse = 0.05, kCoarseTargets = 2;
// Maximum number of objects that a warning names.
constexpr size_t kMostNamed = 6;
// An object is noisy if its noise is above this many targets, unless its light is less than
// kNearlyBlack times that of the scene. A room beside a sunny plain has more light than that.
constexpr double kNoisyTargets = 2;
// An object whose mean squared light is below this share of that of the scene is not worth a finer
// mesh.
constexpr double kDark = 0.01;
// If the surplus is known on less than this share of an object's area, the surplus of all objects
// together is used for it.
constexpr double kKnownShare = 0.3;

// Sums over patches of squares times exposed area. Squares are summed over RGB; the sums are in
// (W/m^2)^2 m^2 except where stated. `signal` is of the light on the patches, `noise` of its noise,
// and `residual` of the difference between the interpolated light and the light on the patches.
struct Squares {
    double signal = 0, noise = 0, residual = 0;
    // Of the light at the corners, in which light that varies within a face is smoothed.
    double shown = 0;
    // The part of `noise` that the interpolation between corners cannot follow.
    double ripple = 0;
    // Noise of the light that corners gather, in addition to that of bundles.
    double gathered = 0;
    // The two parts of the surplus on the patches where it is known, and the signal of these
    // patches.
    double smooth = 0, step = 0, known = 0;
    // Areas with known surplus, of all patches, and of all cells, m^2. Numbers of patches and
    // cells.
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
    // Returns the residual without the noise that it contains. `noiseScale` is the factor on the
    // squared noise.
    double mesh(double noiseScale) const { return std::max(0.0, residual - noiseScale * ripple); }
    // Return the parts of the surplus relative to the signal, as squares. The sum of the steps may
    // be negative by chance.
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

// The errors of one instance: sums over its patches, and the error at each corner.
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
          light(light),
          surplus(surplusOf({patches, sides.exposed}, range.firstParent, range.lastParent,
                            instance.side, sides.irradiance, sides.directError)),
          ofDense(isDense() ? denseSurplus(patches, range.firstParent, range.lastParent,
                                           instance.side, sides.isGathered, light)
                            : std::vector<float>()) {
        std::vector<double> exposed(range.lastCell - range.firstCell, 0.0);  // per cell, m^2
        double gatheredArea = 0;
        forEachPatch([&](uint32_t at, double weight, const Cell& cell, const auto&, double residual,
                         const Surplus& s) {
            exposed[size_t(&cell - &patches.cells[range.firstCell])] += weight;
            const double signal = weight * square(lightAt(at));
            sum.area += weight;
            sum.signal += signal;
            sum.noise += weight * noiseAt(at);
            if (isGathered(at))
                gatheredArea += weight;
            else
                sum.ripple += weight * noiseAt(at);
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
            // A triangle counts with the parallelogram of which it is half, which is about the
            // square of an edge.
            sum.cellArea += double(glm::length(glm::cross(cell.a, cell.b)));
            corners += cell.isTriangle() ? 0.5 : 1.0;
        }
        if (sum.area > 0) gatheredShare = gatheredArea / sum.area;
        if (gatheredShare > 0)
            sum.gathered = std::pow(double(*light.gatheredNoise), 2) * gatheredShare * sum.shown;
        sum.ripple *= rippleShare();
    }

    const Squares& squares() const { return sum; }
    // Returns the share of the area whose light the corners gather, 0 to 1.
    double shareGathered() const { return gatheredShare; }

    // Returns the RMS error around each corner as radiance, W/(m^2 sr). `corners` is the number of
    // corners of the mesh, and `noiseScale` the factor on the squared noise. `unknownShare` is the
    // squared surplus relative to the signal, for patches with too few patches around them.
    std::vector<float> perCorner(size_t corners, double noiseScale, double unknownShare) const {
        std::vector<double> squares(corners, 0), weights(corners, 0);
        const double ripple = sum.noise > 0 ? sum.ripple / sum.noise : 0;
        forEachPatch([&](uint32_t at, double weight, const Cell& cell,
                         const std::array<float, 4>& w, double residual, const Surplus& s) {
            const double beyond = s.isKnown ? double(s.smooth + std::max(s.step, 0.0f))
                                            : unknownShare * square(lightAt(at));
            const double noise = noiseScale * noiseAt(at) +
                                 (isGathered(at) ? std::pow(double(*this->light.gatheredNoise), 2) *
                                                       square(lightAt(at))
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
    bool isDense() const { return light.gatheredNoise && !instance.hasSparseResults; }
    bool isGathered(uint32_t at) const { return light.gatheredNoise && sides.isGathered[at]; }
    bool hasResult(uint32_t at) const {
        return instance.hasResultOnFace(size_t(patches.parentAt(at).face));
    }
    // Returns the squared noise on a side, summed over RGB, (W/m^2)^2.
    double noiseAt(uint32_t at) const {
        if (sides.noise.empty()) return 0;
        return square(sides.noise[at]) + 3 * double(sides.directError[at] * sides.directError[at]);
    }

    // Returns the share of the noise that differs from patch to patch and that the corners cannot
    // follow.
    double rippleShare() const {
        if (sides.noise.empty() || gatheredShare == 1) return 0;
        double rough = 0, all = 0;
        for (const TilePair& pair :
             neighbouringTiles(patches, range.firstParent, range.lastParent)) {
            const uint32_t a = 2 * pair.first + side, b = 2 * pair.second + side;
            if (!hasResult(a) || !hasResult(b) || isGathered(a) || isGathered(b)) continue;
            const double direct =
                noiseAt(a) - square(sides.noise[a]) + noiseAt(b) - square(sides.noise[b]);
            rough += 0.5 * (square(sides.noise[a] - sides.noise[b]) + direct);
            all += 0.5 * (noiseAt(a) + noiseAt(b));
        }
        const double unfollowed = std::max(0.0, 1 - corners / std::max(1.0, sum.patches));
        return all > 0 ? std::min(1.0, rough / all) * unfollowed : 0;
    }

    // Calls body(side, exposed area, cell, corner weights at the centroid, squared residual,
    // surplus) for each patch with a result.
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
                // The mean of the interpolation over the patch is its value at the centroid.
                const auto w = cell.weights(parent.position(parent.pointOn(k, middle)));
                glm::vec3 shown(0.0f);
                for (int c = 0; c < 4; ++c)
                    if (cell.corner[c] >= 0)
                        shown += w[c] * (light.direct[size_t(cell.corner[c])] +
                                         light.indirect[size_t(cell.corner[c])]);
                // The patches of a cut tile resolve a part of the tile's surplus. This part is
                // known but still an error of the mesh, because the interpolation between corners
                // does not follow it: no face is smaller than a tile.
                Surplus beyond = surplus[patch - first];
                beyond.smooth = std::ldexp(beyond.smooth, -4 * tiles.level(patch));
                beyond.step = std::ldexp(beyond.step, -tiles.level(patch));
                const Surplus& whole = surplus[patch - first];
                const double known = double(whole.smooth - beyond.smooth) +
                                     std::max(0.0, double(whole.step - beyond.step));
                if (isGathered(at))
                    body(at, weight, cell, w,
                         ofDense.empty() ? 0.0 : double(ofDense[patch - first]),
                         Surplus{true,
                                 light.gatheredSurplus * light.gatheredSurplus *
                                     float(square(lightAt(at))),
                                 0});
                else
                    body(at, weight, cell, w, square(shown - lightAt(at)) + known, beyond);
            }
        }
    }

    const Instance& instance;
    const Tiles& tiles;
    const Patches& patches;  // each is a tile
    const InstanceRange& range;
    const uint32_t side;
    const SideErrors& sides;
    const InstanceLight& light;
    const std::vector<Surplus> surplus;
    const std::vector<float> ofDense;  // empty if the corners have not gathered as on dense faces
    Squares sum;
    double gatheredShare = 0;
    double corners = 0;  // about the number of corners of the cells with a result
};

// Returns the relative errors. `noise` is the relative noise at corners, as predicted from the
// patches, and `discretisation` the squared relative surplus.
Report::Errors relative(const Squares& s, double noiseScale, double noise, double discretisation) {
    if (!(s.signal > 0)) return {};
    return {std::hypot(noise, s.shown > 0 ? std::sqrt(s.gathered / s.shown) : 0),
            std::sqrt(discretisation), std::sqrt(s.mesh(noiseScale) / s.signal),
            std::sqrt(noiseScale * s.noise / s.signal)};
}

// Returns the length of the edges, m, at which the error by the surplus of patches would be
// `limit`. The error falls with the square of the edge where light is smooth, and with its square
// root at steps.
double edgeFor(double limit, double smoothShare, double stepShare, double patchEdge) {
    double low = 0, high = 1e6;
    for (int k = 0; k < 60; ++k) {
        const double ratio = std::sqrt(std::max(low, 1e-6) * high);
        const double error = smoothShare * std::pow(ratio, 4) + stepShare * ratio;
        (error > limit * limit ? high : low) = ratio;
    }
    return low * patchEdge;
}

// Warns of noisy objects and names the noisiest. `noises` holds the relative noise and the name of
// each noisy object.
void warnOfNoise(std::vector<std::pair<double, std::string>> noises, double target,
                 bool isOutOfReach, Report& report) {
    if (noises.empty()) return;
    std::stable_sort(noises.begin(), noises.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    const size_t named = std::min(noises.size(), kMostNamed);
    std::string text =
        "some objects are noisier than twice the target of " + inPercent(target) + ":";
    for (size_t k = 0; k < named; ++k)
        text += (k > 0 ? ", \"" : " object \"") + noises[k].second + "\" (" +
                inPercent(noises[k].first) + ")";
    if (noises.size() > named)
        text += " and " + std::to_string(noises.size() - named) +
                " more (the report lists the noise of each object)";
    report.warn(
        WarningId::NOISY_OBJECTS,
        text + (isOutOfReach ? ". Only few lines bring light to these objects, so that a lower "
                               "target_error takes long and gains little; add lamps, or accept the "
                               "noise"
                             : "; lower target_error, or increase max_bundles if the bake reached "
                               "it"));
}

// A mesh that is too coarse: its squared error, and the text of the warning.
using CoarseMesh = std::pair<double, std::string>;

// Returns the warning if the mesh of an object is too coarse. `limit` is the largest relative error
// that is allowed, and `remedy` what the warning advises.
std::optional<CoarseMesh> coarseMesh(const std::string& name, const Squares& s, double noiseScale,
                                     double limit, double smoothShare, double stepShare,
                                     const char* remedy) {
    const double mesh = std::sqrt(s.mesh(noiseScale) / s.signal);
    if (mesh <= limit || s.cells == 0) return std::nullopt;
    const double faceEdge = std::sqrt(s.cellArea / s.cells);
    const double patchEdge = std::sqrt(s.area / s.patches);
    const double edge = std::min(edgeFor(limit, smoothShare, stepShare, patchEdge), 0.5 * faceEdge);
    return CoarseMesh{
        s.mesh(noiseScale),
        "object \"" + name + "\": its faces, " + inMetres(faceEdge) +
            " wide on average, are too coarse for its light. Interpolation over the faces causes "
            "an error of " +
            inPercent(mesh) + ". Edges of about " + inMetres(edge) + " would reduce the error to " +
            inPercent(limit) + "; " + remedy};
}

// Warns of coarse meshes and names those with the largest errors.
void warnOf(std::vector<CoarseMesh> meshes, Report& report) {
    std::stable_sort(meshes.begin(), meshes.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    const size_t named = std::min(meshes.size(), kMostNamed);
    for (size_t k = 0; k < named; ++k)
        report.warn(WarningId::COARSE_MESH, std::move(meshes[k].second));
    if (meshes.size() > named)
        report.warn(WarningId::COARSE_MESH,
                    std::to_string(meshes.size() - named) +
                        " more objects are too coarse for their light; the report lists the error "
                        "of each object");
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

    // The scale includes the error that both halves share.
    const double noiseScale =
        all.noise > 0 ? report.estimatedError * report.estimatedError * all.signal / all.noise : 0;
    const double shown = report.error.noise;  // measured by the bake at all corners
    const double limit = std::max(kCoarse, kCoarseTargets * targetError);
    double discretisation = 0;
    const char* const remedy = settings.adaptMeshes
                                   ? "lower target_error, or raise max_vertices if it was reached"
                                   : "subdivide the mesh, or choose the topology ADAPTIVE";
    std::vector<CoarseMesh> coarse;
    std::vector<std::pair<double, std::string>> noisy;
    for (size_t i = 0; i < light.size(); ++i) {
        throwIfCancelledAt(i);
        if (!errors[i]) continue;
        const Squares& own = errors[i]->squares();
        const Squares& known = own.knownArea >= kKnownShare * own.area ? own : all;
        const double smooth = known.smoothShare(), step = known.stepShare();
        discretisation += (smooth + step) * own.signal / all.signal;
        // The light that corners gather comes from many patches of the whole scene, so the noise of
        // the whole scene counts.
        const double ofPatches = errors[i]->shareGathered() > 0.5
                                     ? shown
                                     : std::max(sides.ofObjects[i], errsAlike ? shown : 0);
        report.objects[i].error = relative(own, noiseScale, ofPatches, smooth + step);
        light[i].error = errors[i]->perCorner(light[i].direct.size(), noiseScale, smooth + step);
        const double noise = report.objects[i].error.noise;
        const double brightness = own.signal / own.area * all.area / all.signal;
        const double allowed = kNoisyTargets * targetError * double(scene.instances[i].noiseFactor);
        if (!errsAlike && noise > allowed && brightness > kNearlyBlack * kNearlyBlack)
            noisy.push_back({noise, light[i].name});
        if (!(brightness > kDark)) continue;
        if (auto mesh = coarseMesh(light[i].name, own, noiseScale, limit, smooth, step, remedy))
            coarse.push_back(std::move(*mesh));
    }
    warnOfNoise(std::move(noisy), targetError, sides.isOutOfReach, report);
    warnOf(std::move(coarse), report);
    report.error = relative(all, noiseScale, shown, discretisation);
    report.error.ofPatches = report.estimatedError;
}

}  // namespace raybundle
