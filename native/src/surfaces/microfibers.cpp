// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/microfibers.h"

#include <algorithm>
#include <cmath>

namespace raybundle {
namespace {

constexpr int kFiberRoughnesses = 9, kFiberCosines = 7;
constexpr float kLeastRoughness = 0.2f;

// One row for each roughness from kLeastRoughness to 1, one column for each square root of the
// cosine from 1 / 7 to 1. The square root gives finer steps towards grazing angles, where the
// values change fast.
using Table = float[kFiberRoughnesses][kFiberCosines];
constexpr Table kAlbedo = {{0.6072f, 0.3602f, 0.1106f, 0.0140f, 0.0015f, 0.0003f, 0.0001f},
                           {0.6474f, 0.4800f, 0.2652f, 0.0906f, 0.0198f, 0.0037f, 0.0008f},
                           {0.6604f, 0.5410f, 0.3724f, 0.1948f, 0.0732f, 0.0205f, 0.0049f},
                           {0.6675f, 0.5775f, 0.4455f, 0.2878f, 0.1479f, 0.0599f, 0.0186f},
                           {0.6752f, 0.6052f, 0.5001f, 0.3653f, 0.2278f, 0.1194f, 0.0504f},
                           {0.6858f, 0.6301f, 0.5452f, 0.4317f, 0.3039f, 0.1909f, 0.1041f},
                           {0.7009f, 0.6554f, 0.5854f, 0.4883f, 0.3751f, 0.2670f, 0.1759f},
                           {0.7200f, 0.6817f, 0.6213f, 0.5376f, 0.4383f, 0.3418f, 0.2577f},
                           {0.7406f, 0.7076f, 0.6546f, 0.5803f, 0.4944f, 0.4122f, 0.3419f}};
constexpr Table kA = {{0.0734f, 0.1069f, 0.1351f, 0.1565f, 0.1889f, 0.2499f, 0.3726f},
                      {0.1160f, 0.1675f, 0.2273f, 0.2632f, 0.2910f, 0.3314f, 0.4239f},
                      {0.1756f, 0.2322f, 0.2996f, 0.3501f, 0.3846f, 0.4216f, 0.4931f},
                      {0.2497f, 0.3082f, 0.3768f, 0.4343f, 0.4745f, 0.5120f, 0.5678f},
                      {0.3355f, 0.3972f, 0.4652f, 0.5254f, 0.5699f, 0.6062f, 0.6464f},
                      {0.4354f, 0.4987f, 0.5641f, 0.6174f, 0.6586f, 0.6927f, 0.7223f},
                      {0.5466f, 0.6057f, 0.6644f, 0.7089f, 0.7402f, 0.7644f, 0.7862f},
                      {0.6523f, 0.7021f, 0.7511f, 0.7864f, 0.8095f, 0.8255f, 0.8378f},
                      {0.7379f, 0.7782f, 0.8177f, 0.8457f, 0.8628f, 0.8734f, 0.8796f}};
constexpr Table kB = {{-0.1251f, -0.0239f, -0.0095f, -0.0139f, -0.0282f, -0.0404f, 0},
                      {-0.1615f, -0.0884f, -0.0262f, -0.0196f, -0.0261f, -0.0403f, 0},
                      {-0.1757f, -0.1398f, -0.0730f, -0.0370f, -0.0331f, -0.0381f, 0},
                      {-0.1740f, -0.1583f, -0.1168f, -0.0712f, -0.0476f, -0.0411f, 0},
                      {-0.1628f, -0.1566f, -0.1301f, -0.0988f, -0.0705f, -0.0473f, 0},
                      {-0.1422f, -0.1395f, -0.1226f, -0.1005f, -0.0791f, -0.0560f, 0},
                      {-0.1085f, -0.1066f, -0.0968f, -0.0835f, -0.0688f, -0.0502f, 0},
                      {-0.0595f, -0.0586f, -0.0548f, -0.0494f, -0.0425f, -0.0320f, 0},
                      {0, 0, 0, 0, 0, 0, 0}};

}  // namespace

Microfibers Microfibers::at(float roughness, float cosine) {
    const float r = std::clamp((roughness - kLeastRoughness) / (1 - kLeastRoughness), 0.0f, 1.0f) *
                    (kFiberRoughnesses - 1);
    const float c = std::clamp(std::sqrt(std::max(cosine, 0.0f)) * kFiberCosines - 1, 0.0f,
                               float(kFiberCosines - 1));
    const int i = std::min(int(r), kFiberRoughnesses - 2), j = std::min(int(c), kFiberCosines - 2);
    const float u = r - float(i), v = c - float(j);
    auto of = [&](const Table& table) {
        return (1 - u) * ((1 - v) * table[i][j] + v * table[i][j + 1]) +
               u * ((1 - v) * table[i + 1][j] + v * table[i + 1][j + 1]);
    };
    return {of(kAlbedo), of(kA), of(kB)};
}

}  // namespace raybundle
