// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace raybundle {

// Returns a hash of `x` in which each bit of `x` affects all bits of the result. Different numbers
// have different hashes. Source: Steele, Lea and Flood, "Fast Splittable Pseudorandom Number
// Generators" (2014).
inline uint64_t mixBits(uint64_t x) {
    x += 0x9e3779b97f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
}

}  // namespace raybundle
