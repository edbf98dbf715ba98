// SPDX-License-Identifier: GPL-3.0-or-later
#include "sampling/sobol.h"

#include "sampling/mix_bits.h"

namespace raybundle {
namespace {

// Generator matrices of the four dimensions. Element [d][k] is the column that bit k of an index
// contributes to dimension d, with the first binary digit in the highest bit.
using Columns = std::array<std::array<uint32_t, 32>, 4>;

// Computes the generator matrices from primitive polynomials of degree s with coefficients a, and
// initial direction numbers m (Joe and Kuo). Dimension 0 is the van der Corput sequence and needs
// no polynomial.
Columns sobolColumns() {
    struct Polynomial {
        int s;
        uint32_t a;
        std::array<uint32_t, 3> m;
    };
    const std::array<Polynomial, 3> polynomials = {
        Polynomial{1, 0, {1, 0, 0}}, Polynomial{2, 1, {1, 3, 0}}, Polynomial{3, 1, {1, 3, 1}}};
    Columns v{};
    for (int k = 0; k < 32; ++k) v[0][k] = 1u << (31 - k);
    for (int d = 0; d < 3; ++d) {
        const auto& [s, a, m] = polynomials[d];
        for (int k = 0; k < 32; ++k) {
            if (k < s) {
                v[d + 1][k] = m[k] << (31 - k);
                continue;
            }
            v[d + 1][k] = v[d + 1][k - s] ^ (v[d + 1][k - s] >> s);
            for (int i = 1; i < s; ++i)
                if ((a >> (s - 1 - i)) & 1) v[d + 1][k] ^= v[d + 1][k - i];
        }
    }
    return v;
}

}  // namespace

uint32_t hash(uint32_t a, uint32_t b) { return uint32_t(mixBits(uint64_t(a) << 32 | b)); }

SobolPoints::SobolPoints(uint32_t seed) : tables(allTables()) {
    for (uint32_t d = 0; d < 4; ++d) shift[d] = hash(seed, d);
}

const SobolPoints::Bits* SobolPoints::allTables() {
    using Tables = std::array<Bits, size_t(kTables) * kTableSize>;
    static const Tables tables = [] {
        const Columns columns = sobolColumns();
        Tables made{};
        for (uint32_t table = 0; table < kTables; ++table)
            for (uint32_t i = 0; i < kTableSize; ++i)
                for (uint32_t k = 0; k < kTableBits; ++k)
                    for (uint32_t d = 0; i >> k & 1 && d < 4; ++d)
                        made[table * kTableSize + i][d] ^= columns[d][table * kTableBits + k];
        return made;
    }();
    return tables.data();
}

}  // namespace raybundle
