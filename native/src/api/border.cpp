// SPDX-License-Identifier: GPL-3.0-or-later
#include "api/border.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#if defined(__x86_64__) && defined(__SSE4_2__)
#include <cpuid.h>
#endif

namespace {

// A plain array instead of a string, because memory may have run out when a message is stored:
// glibc ends the process if it cannot allocate the record for the destructor of a thread_local
// string.
thread_local char lastMessage[2048];

}  // namespace

namespace raybundle {

rb_error fail(rb_error code, const char* message) noexcept {
    size_t length = std::min(std::strlen(message), sizeof(lastMessage) - 1);
    // Do not cut inside a multi-byte character of UTF-8.
    while (length > 0 && (message[length] & 0xC0) == 0x80) --length;
    std::memcpy(lastMessage, message, length);
    lastMessage[length] = 0;
    return code;
}

void makeRoomForMessage() noexcept {
    // glibc allocates the thread-local variables of a library that is loaded at run time when they
    // are first used. This access allocates them early.
    volatile char& last = lastMessage[sizeof(lastMessage) - 1];
    last = 0;
}

void needProcessor() {
#if defined(__x86_64__) && defined(__SSE4_2__)
    // Asks the processor and not __builtin_cpu_supports, which needs a function of the compiler's
    // library that fills in its answers before. Zig's compiler has none: it always answers no.
    static const bool isEnough = [] {
        unsigned a, b, features, d;
        return __get_cpuid(1, &a, &b, &features, &d) && (features & bit_SSE4_2) &&
               (features & bit_POPCNT);
    }();
    if (!isEnough)
        throw Error(RB_ERROR_UNSUPPORTED_HARDWARE,
                    "this processor does not support SSE 4.2 and POPCNT, which Raybundle requires");
#endif
}

uintptr_t nextHandle() {
    static std::atomic<uintptr_t> last{0};
    return ++last;
}

void need(const void* pointer, const char* name) {
    if (!pointer) throw invalidArgument(std::string(name) + " must not be NULL");
}

void needArray(const void* pointer, size_t count, const char* name) {
    if (count > 0) need(pointer, name);
    // Indices into all arrays must fit into 32 bits.
    if (count > size_t(INT32_MAX))
        throw invalidArgument(std::string(name) + " has too many elements");
}

void needCount(size_t given, size_t wanted, const char* what) {
    if (given != wanted)
        throw invalidArgument(std::string(what) + " must be " + std::to_string(wanted) + ", not " +
                              std::to_string(given));
}

void needFinite(const float* values, size_t count, const char* what) {
    for (size_t i = 0; i < count; ++i)
        if (!std::isfinite(values[i]))
            throw invalidArgument(std::string(what) + " " + std::to_string(i) +
                                  " is not a finite number");
}

void copyLight(const std::vector<glm::vec3>& light, float* rgb, size_t count) {
    needCount(count, light.size(), "count");
    needArray(rgb, count, "rgb");
    if (count) std::memcpy(rgb, light.data(), count * sizeof(glm::vec3));
}

Mesh makeMesh(const char* name, const float* vertices, size_t vertexCount,
              const int32_t* cornerVertices, size_t cornerCount, const int32_t* faceOffsets,
              size_t faceCount) {
    needArray(vertices, vertexCount, "vertices");
    needArray(cornerVertices, cornerCount, "corner_vertices");
    needArray(faceOffsets, faceCount, "face_offsets");
    Mesh mesh;
    mesh.name = nameOf(name);
    mesh.vertices = vectors<glm::vec3>(vertices, vertexCount);
    if (cornerCount) mesh.cornerVertices.assign(cornerVertices, cornerVertices + cornerCount);
    mesh.faceOffsets = {0};
    if (faceCount) mesh.faceOffsets.assign(faceOffsets, faceOffsets + faceCount + 1);
    return mesh;
}

}  // namespace raybundle

int32_t rb_get_abi_version(void) { return RB_ABI_VERSION; }

const char* rb_get_version(void) { return RAYBUNDLE_VERSION; }

const char* rb_get_error_message(void) { return lastMessage; }
