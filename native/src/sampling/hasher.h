// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace raybundle {

// 64-bit words mixed one after the other, after MurmurHash2 (Appleby, public domain).
class Hasher {
  public:
    // Values without padding.
    template <class... T>
    void add(const T&... values) {
        (addBytes(&values, sizeof(T)), ...);
    }
    template <class T>
    void add(const std::vector<T>& values) {
        addBytes(values.data(), values.size() * sizeof(T));
    }
    void add(const std::string& text) { addBytes(text.data(), text.size()); }
    uint64_t value() const { return state; }

  private:
    void addBytes(const void* data, size_t bytes) {
        const unsigned char* at = static_cast<const unsigned char*>(data);
        mix(bytes);
        for (; bytes >= 8; bytes -= 8, at += 8) {
            uint64_t word;
            std::memcpy(&word, at, 8);
            mix(word);
        }
        uint64_t rest = 0;
        if (bytes > 0) std::memcpy(&rest, at, bytes);  // an empty vector has no address
        mix(rest);
    }
    void mix(uint64_t word) {
        constexpr uint64_t kMultiplier = 0xc6a4a7935bd1e995ull;
        word *= kMultiplier;
        word ^= word >> 47;
        word *= kMultiplier;
        state = (state ^ word) * kMultiplier;
    }

    uint64_t state = 0x9e3779b97f4a7c15ull;
};

}  // namespace raybundle
