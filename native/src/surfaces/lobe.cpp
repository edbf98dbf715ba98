// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/lobe.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "surfaces/microfibers.h"

namespace raybundle {
namespace {

// Quadrature of a wide lobe: Gauss-Legendre points along the cosine, and equal steps of the
// azimuth.
constexpr int kCosines = 8, kAngles = 16;
constexpr float kCosine[kCosines] = {0.01985507f, 0.10166676f, 0.23723380f, 0.40828268f,
                                     0.59171732f, 0.76276620f, 0.89833324f, 0.98014493f};
constexpr float kWeight[kCosines] = {0.05061427f, 0.11119052f, 0.15685332f, 0.18134189f,
                                     0.18134189f, 0.15685332f, 0.11119052f, 0.05061427f};
// Cosines of the azimuths on one side of the plane of incidence.
constexpr float kCosineOfAngle[kAngles / 2 + 1] = {
    1, 0.92387953f, 0.70710678f, 0.38268343f, 0, -0.38268343f, -0.70710678f, -0.92387953f, -1};
// The table of gloss: steps of the roughness and of the cosine, and for each entry, rings of
// visible normals and normals in each ring.
constexpr int kRoughnesses = 21, kTableCosines = 25, kRings = 48, kInRing = 12;
// Mean of fresnelEdge() over all directions, weighted by the cosine.
constexpr float kMeanEdge = 0.0534f;
// Smaller cosines count as this one, so that visibility() stays finite.
constexpr float kLeastCosine = 1e-3f;
// Least roughness of cloth. Smoother cloth reflects a few hundredths of the light, in lobes that
// are narrower than the quadrature resolves.
constexpr float kLeastClothRoughness = 0.2f;

float fifthPower(float x) {
    const float square = x * x;
    return square * square * x;
}

// Returns (1 + 2 Lambda) times the cosine, where Lambda is Smith's for GGX and `a2` is alpha
// squared.
float maskingTerm(float cosine, float a2) { return std::sqrt(a2 + (1 - a2) * cosine * cosine); }

// Returns the rise of Fresnel's reflectance, from 0 at normal incidence to 1 at grazing incidence,
// for an index of refraction of 1.5. Fitted to Fresnel's law with an error of at most 0.0015.
// (Schlick's fifth power has an error of 0.03, and at 60 degrees of one half of the value.)
float fresnelEdge(float cosine) {
    const float x = 1 - cosine, x2 = x * x, x3 = x2 * x, x5 = x3 * x2;
    return 0.3429f * x3 + 0.2440f * x5 + 0.4131f * x5 * x2 * x2;
}

// Returns the RMS deviation relative to the mean.
float rmsOf(float mean, float meanSquare) {
    return mean > 0 ? std::sqrt(std::max(0.0f, meanSquare / (mean * mean) - 1)) : 0;
}

}  // namespace

Lobe::Kind Lobe::glossOf(rb_masking masking) {
    return masking == RB_MASKING_SEPARATE ? Kind::SEPARATE_GLOSS : Kind::GLOSS;
}

Lobe::Lobe(Kind kind, const glm::vec3& normal, const glm::vec3& incoming, float roughness)
    : kind(kind),
      normal(normal),
      incoming(incoming),
      cosine(std::max(glm::dot(normal, incoming), kLeastCosine)),
      shadowing(maskingTerm(cosine, roughness)),
      roughness(roughness) {}

// Moments of an unscaled gloss lobe. Fresnel's reflectance is linear in f0: the mean is white f0 +
// edge (1 - f0), and the mean square is the corresponding square. Several facets use only the white
// terms.
struct Lobe::Moments {
    float white = 0, edge = 0, white2 = 0, both2 = 0, edge2 = 0;

    void add(float factor, const Moments& other) {
        white += factor * other.white;
        edge += factor * other.edge;
        white2 += factor * other.white2;
        both2 += factor * other.both2;
        edge2 += factor * other.edge2;
    }
    float mean(float f0) const { return white * f0 + edge * (1 - f0); }
    float meanSquare(float f0) const {
        const float rest = 1 - f0;
        return white2 * f0 * f0 + 2 * both2 * f0 * rest + edge2 * rest * rest;
    }
};

// Table of moments by roughness and by the square root of the cosine, since lobes change fast
// towards grazing angles. Each table is computed at its first use.
class Lobe::GlossTable {
  public:
    static const GlossTable& of(Kind kind) {
        if (kind == Kind::SEPARATE_GLOSS) {
            static const GlossTable separate(kind);
            return separate;
        }
        if (kind == Kind::SEVERAL_FACETS) {
            static const GlossTable several(kind);
            return several;
        }
        static const GlossTable together(Kind::GLOSS);
        return together;
    }

    // Returns the moments at a roughness and a cosine, by bilinear interpolation.
    Moments at(float roughness, float cosine) const {
        Moments sum;
        around(roughness, cosine,
               [&](float share, const Moments& entry) { sum.add(share, entry); });
        return sum;
    }
    // Returns Moments::white, which is also the albedo by the angle of view.
    float albedo(float roughness, float cosine) const {
        float sum = 0;
        around(roughness, cosine,
               [&](float share, const Moments& entry) { sum += share * entry.white; });
        return sum;
    }
    // Returns the light that several facets reflect relative to that of one facet, at an angle of
    // view.
    float lost(float roughness, float cosine) const {
        return std::max(1 / albedo(roughness, cosine) - 1, 0.0f);
    }

    // Returns the moments for light from all directions.
    Moments everywhere(float roughness) const {
        Moments sum;
        for (int k = 0; k < kCosines; ++k)
            sum.add(2 * kCosine[k] * kWeight[k], at(roughness, kCosine[k]));
        return sum;
    }

  private:
    explicit GlossTable(Kind kind) {
        for (int i = 0; i < kRoughnesses; ++i)
            for (int j = 0; j < kTableCosines; ++j) {
                const float cosine = float(j * j) / ((kTableCosines - 1) * (kTableCosines - 1));
                moments[size_t(i)][size_t(j)] = find(
                    kind, kLeastRoughness + (1 - kLeastRoughness) * float(i) / (kRoughnesses - 1),
                    std::max(cosine, kLeastCosine));
            }
    }

    // Visits the four entries around a roughness and a cosine, with their weights.
    template <class Visit>
    void around(float roughness, float cosine, const Visit& visit) const {
        const float r = (roughness - kLeastRoughness) / (1 - kLeastRoughness) * (kRoughnesses - 1);
        const float c = std::sqrt(cosine) * (kTableCosines - 1);
        const int i = std::clamp(int(r), 0, kRoughnesses - 2);
        const int j = std::clamp(int(c), 0, kTableCosines - 2);
        for (int di = 0; di < 2; ++di)
            for (int dj = 0; dj < 2; ++dj)
                visit(
                    (di ? r - float(i) : 1 - r + float(i)) * (dj ? c - float(j) : 1 - c + float(j)),
                    moments[size_t(i + di)][size_t(j + dj)]);
    }

    // Integrates over visible normals, whose weights are F G / G1, on one side of the plane of
    // incidence.
    static Moments find(Kind kind, float roughness, float cosine);

    std::array<std::array<Moments, kTableCosines>, kRoughnesses> moments;
};

Lobe::Moments Lobe::GlossTable::find(Kind kind, float roughness, float cosine) {
    Moments sum;
    const float alpha = roughness * roughness;
    const glm::vec3 in(std::sqrt(1 - cosine * cosine), 0, cosine);
    const Lobe white(kind, glm::vec3(0, 0, 1), in, alpha * alpha);
    const glm::vec3 stretched = glm::normalize(glm::vec3(alpha * in.x, 0, in.z));
    const glm::vec3 t1(0, 1, 0), t2 = glm::cross(stretched, t1);
    for (int i = 0; i < kRings; ++i)
        for (int j = 0; j < kInRing; ++j) {
            // Rings are closer towards the rim, where normals mirror light to directions near the
            // surface.
            const float inward = 1 - (float(i) + 0.5f) / kRings, r = 1 - inward * inward;
            const float angle = glm::pi<float>() * ((float(j) + 0.5f) / kInRing - 0.5f);
            const float p1 = r * std::cos(angle), half = 0.5f * (1 + stretched.z);
            const float p2 = (1 - half) * std::sqrt(1 - p1 * p1) + half * r * std::sin(angle);
            const glm::vec3 n =
                p1 * t1 + p2 * t2 + std::sqrt(std::max(0.0f, 1 - p1 * p1 - p2 * p2)) * stretched;
            const glm::vec3 h =
                glm::normalize(glm::vec3(alpha * n.x, alpha * n.y, std::max(n.z, 0.0f)));
            const float ih = std::min(glm::dot(in, h), 1.0f), no = 2 * ih * h.z - in.z;
            if (no <= 0) continue;
            // G / G1, with G = 4 ni no visibility and G1 = 2 ni / (ni + shadowing).
            const float visible = 2 * no * (cosine + white.shadowing) * white.visibility(no);
            const float more =
                kind == Kind::SEVERAL_FACETS ? of(Kind::GLOSS).lost(roughness, no) : 1;
            const float share = more * visible * 4 * r * inward / (kRings * kInRing);
            const auto [value, edge] = white.shape(no, 2 * ih * ih - 1);
            sum.add(share, {1, edge, value, value * edge, value * edge * edge});
        }
    return sum;
}

Lobe Lobe::gloss(const glm::vec3& normal, const glm::vec3& incoming, rb_masking masking,
                 float roughness, const glm::vec3& f0) {
    const float rough = std::clamp(roughness, kLeastRoughness, 1.0f), alpha = rough * rough;
    Lobe lobe(glossOf(masking), normal, incoming, alpha * alpha);
    const Moments moments = GlossTable::of(lobe.kind).at(rough, lobe.cosine);
    for (int c = 0; c < 3; ++c) {
        const float mean = moments.mean(f0[c]);
        lobe.facing[c] = f0[c] / mean;
        lobe.rising[c] = (1 - f0[c]) / mean;
        lobe.rms = std::max(lobe.rms, rmsOf(mean, moments.meanSquare(f0[c])));
    }
    return lobe;
}

float Lobe::f0Of(float ratio, rb_masking masking, float roughness) {
    const float rough = std::clamp(roughness, kLeastRoughness, 1.0f);
    const GlossTable& table = GlossTable::of(glossOf(masking));
    // Below the table's least roughness, interpolate towards a mirror, about in proportion to
    // alpha.
    const float share = std::min(roughness * roughness / (kLeastRoughness * kLeastRoughness), 1.0f);
    Moments above, all;
    above.add(share, table.at(rough, 1));
    above.add(1 - share, {1, 0});
    all.add(share, table.everywhere(rough));
    all.add(1 - share, {1, kMeanEdge});
    // Solve ratio = (white above f0 + edge above (1 - f0)) / (white f0 + edge (1 - f0)) for f0,
    // where the numerator holds the moments `above` and the denominator the moments `all`.
    const float rest = above.white - above.edge - ratio * (all.white - all.edge);
    return rest > 0 ? std::clamp((ratio * all.edge - above.edge) / rest, 0.0f, 1.0f) : 1;
}

Lobe Lobe::diffuse(const glm::vec3& normal, const glm::vec3& incoming, rb_diffuse_model model,
                   float roughness) {
    Lobe lobe(model == RB_DIFFUSE_BURLEY ? Kind::BURLEY : Kind::OREN_NAYAR, normal, incoming,
              roughness);
    lobe.normalise();
    return lobe;
}

Lobe Lobe::of(LobeKind lobe, const glm::vec3& normal, const glm::vec3& incoming, float roughness) {
    if (lobe == LobeKind::SEVERAL_FACETS) {
        const float rough = std::clamp(roughness, kLeastRoughness, 1.0f), alpha = rough * rough;
        Lobe several(Kind::SEVERAL_FACETS, normal, incoming, alpha * alpha);
        const Moments moments = GlossTable::of(several.kind).at(rough, several.cosine);
        several.normalise(moments.white, moments.white2);
        return several;
    }
    const Kind kind = lobe == LobeKind::MICROFIBERS ? Kind::MICROFIBERS
                      : lobe == LobeKind::VELVET    ? Kind::VELVET
                                                    : Kind::BURLEY_SHEEN;
    Lobe cloth(kind, normal, incoming, std::max(roughness, kLeastClothRoughness));
    cloth.normalise();
    return cloth;
}

void Lobe::normalise() {
    const float sineIn = std::sqrt(std::max(1 - cosine * cosine, 0.0f));
    float mean = 0, meanSquare = 0;
    for (int i = 0; i < kCosines; ++i) {
        const float no = kCosine[i], sines = sineIn * std::sqrt(1 - no * no);
        // The lobe is symmetric about the plane of incidence: only azimuths on one side are
        // evaluated.
        for (int j = 0; j <= kAngles / 2; ++j) {
            const float value = shape(no, sines * kCosineOfAngle[j] + no * cosine).first;
            const float count = j % (kAngles / 2) == 0 ? 1 : 2;
            mean += 2 * no * kWeight[i] * count / kAngles * value;
            meanSquare += 2 * no * kWeight[i] * count / kAngles * value * value;
        }
    }
    normalise(mean, meanSquare);
}

void Lobe::normalise(float mean, float meanSquare) {
    facing = glm::vec3(mean > 0 ? 1 / mean : 0);
    rms = rmsOf(mean, meanSquare);
}

float Lobe::visibility(float out) const {
    const float term = maskingTerm(out, roughness);
    return kind == Kind::SEPARATE_GLOSS ? 1 / ((cosine + shadowing) * (out + term))
                                        : 0.5f / (cosine * term + out * shadowing);
}

glm::vec3 Lobe::towards(const glm::vec3& direction) const {
    const auto [value, rise] = shape(glm::dot(normal, direction), glm::dot(incoming, direction));
    return value * (facing + rise * rising);
}

// `facing` and `rising` are f0 and 1 - f0, divided by the mean.
glm::vec3 Lobe::mean() const { return 1.0f / glm::max(facing + rising, 1e-30f); }

std::pair<float, float> Lobe::shape(float no, float io) const {
    if (no <= 0) return {0, 0};
    const float ni = cosine;
    io = std::min(io, 1.0f);
    switch (kind) {
        case Kind::GLOSS:
        case Kind::SEPARATE_GLOSS:
        case Kind::SEVERAL_FACETS: {
            // pi D F G / (4 ni no) without F, with the half vector (incoming + direction) / sqrt(2
            // + 2 io).
            const float nh2 = std::min((ni + no) * (ni + no) / std::max(2 + 2 * io, 1e-6f), 1.0f);
            const float ih = std::sqrt(0.5f * std::max(1 + io, 0.0f));
            const float d = nh2 * (roughness - 1) + 1;
            const float value = roughness * visibility(no) / (d * d);
            if (kind == Kind::SEVERAL_FACETS) {
                const float rough = std::sqrt(std::sqrt(roughness));
                return {value * GlossTable::of(Kind::GLOSS).lost(rough, no), 0};
            }
            return {value, fresnelEdge(ih)};
        }
        case Kind::BURLEY: {
            const float more = roughness * (1 + io) - 0.5f;
            return {(1 + more * fifthPower(1 - ni)) * (1 + more * fifthPower(1 - no)), 0};
        }
        case Kind::OREN_NAYAR: {
            const float s = io - ni * no;
            return {std::max(0.0f, 1 + roughness * (s > 0 ? s / std::max(ni, no) : s)), 0};
        }
        case Kind::MICROFIBERS: {
            const float sine = std::sqrt(std::max(1 - no * no, 1e-6f));
            return {Microfibers::at(roughness, no).towards((io - ni * no) / sine, ni), 0};
        }
        case Kind::VELVET: {
            // pi D G / (4 ni no), where D is a function of the cotangent of the half vector's
            // angle.
            const float nh2 = std::min((ni + no) * (ni + no) / std::max(2 + 2 * io, 1e-6f), 1.0f);
            const float rest = std::max(1 - nh2, 1e-6f), square = roughness * roughness;
            const float ih = std::sqrt(std::max(0.5f * (1 + io), 1e-6f));
            const float g = std::min(1.0f, 2 * std::sqrt(nh2) * std::min(ni, no) / ih);
            return {0.25f * std::exp(-nh2 / (rest * square)) * g /
                        (square * rest * rest * ni * std::max(no, kLeastCosine)),
                    0};
        }
        case Kind::BURLEY_SHEEN:
            return {fifthPower(1 - std::sqrt(0.5f * std::max(1 + io, 0.0f))), 0};
    }
    return {0, 0};
}

}  // namespace raybundle
