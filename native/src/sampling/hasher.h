// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace raybundle {

// A 64-bit hash of a sequence of values. Each 8-byte word is mixed into the state in turn, as in
// MurmurHash2 (Appleby, public domain). Not cryptographic. The hash depends on the byte order of
// the machine.
class Hasher {
  public:
    // Adds the bytes of each value. The types must have no padding and no pointers, since their
    // memory is hashed byte by byte.
    template <class... T>
    void add(const T&... values) {
        (addBytes(&values, sizeof(T)), ...);
    }
    // Adds the bytes of all elements and their total number. The element type must have no padding
    // and no pointers.
    template <class T>
    void add(const std::vector<T>& values) {
        addBytes(values.data(), values.size() * sizeof(T));
    }
    // Adds the characters of `text` and their number.
    void add(const std::string& text) { addBytes(text.data(), text.size()); }
    // Returns the hash of all values added so far.
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
        if (bytes > 0) std::memcpy(&rest, at, bytes);  // data() of an empty vector may be null
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
