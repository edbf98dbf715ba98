// SPDX-License-Identifier: GPL-3.0-or-later
//
// Shared parts of the extern "C" functions: argument checks, copies of arrays, and the only place
// where exceptions become an error code and a message.
#pragma once

#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <new>
#include <string>
#include <vector>

#include "api/handles.h"
#include "job/error.h"
#include "raybundle/raybundle.h"
#include "scene/scene.h"

namespace raybundle {

// Stores the first 2047 bytes of `message` as the message that rb_get_error_message returns to the
// calling thread, and returns `code`. Allocates no memory if makeRoomForMessage() was called in
// this thread.
rb_error fail(rb_error code, const char* message) noexcept;
void makeRoomForMessage() noexcept;

// Throws Error(UNSUPPORTED_HARDWARE) if the processor lacks an instruction set that the library was
// compiled for. Without this check the first such instruction would end the process.
void needProcessor();

// Runs the body of an API function and returns RB_ERROR_NONE. If the body throws, stores the
// message and returns the error code.
template <class Body>
rb_error guarded(const Body& body) noexcept {
    makeRoomForMessage();
    try {
        needProcessor();
        body();
        return RB_ERROR_NONE;
    } catch (const Error& error) {
        return fail(error.code, error.what());
    } catch (const std::bad_alloc&) {
        return fail(RB_ERROR_OUT_OF_MEMORY, "out of memory");
    } catch (const std::exception& error) {
        return fail(RB_ERROR_UNKNOWN, error.what());
    } catch (...) {
        return fail(RB_ERROR_UNKNOWN, "unknown error");
    }
}

using HeldScene = Held<rb_scene, Scene>;

// Each of these functions throws Error(INVALID_ARGUMENT) with the name of the argument if its check
// fails.
void need(const void* pointer, const char* name);
void needArray(const void* pointer, size_t count, const char* name);
void needCount(size_t given, size_t wanted, const char* what);
void needFinite(const float* values, size_t count, const char* what);

inline std::string nameOf(const char* name) { return name ? name : ""; }
inline glm::vec3 vec3(const float* v) { return {v[0], v[1], v[2]}; }

template <class V>
std::vector<V> vectors(const float* values, size_t count) {
    std::vector<V> result(count);
    if (count) std::memcpy(static_cast<void*>(result.data()), values, count * sizeof(V));
    return result;
}

// Copies the arrays of rb_add_mesh into a Mesh. Throws Error(INVALID_ARGUMENT) if an array is NULL
// or too long. Scene::addMesh checks the indices.
Mesh makeMesh(const char* name, const float* vertices, size_t vertexCount,
              const int32_t* cornerVertices, size_t cornerCount, const int32_t* faceOffsets,
              size_t faceCount);

}  // namespace raybundle
