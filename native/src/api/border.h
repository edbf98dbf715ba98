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

class Bake;
using HeldScene = Held<rb_scene, Scene>;
using HeldBake = Held<rb_bake, Bake>;

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

// Copies `value` to a struct of the caller, whose member `size` holds its size in the caller's
// header. Structs of older callers are shorter. Throws Error(INVALID_ARGUMENT) if the size is 0 or
// larger than that of this library.
template <class Struct>
void fillStruct(Struct* target, Struct value, const char* name) {
    need(target, name);
    if (target->size == 0 || target->size > sizeof(Struct))
        throw invalidArgument(std::string(name) + ": its size must be 1 to " +
                              std::to_string(sizeof(Struct)) + " bytes, the sizeof of the struct");
    value.size = target->size;
    std::memcpy(target, &value, value.size);
}

// Copies values to an array of the caller that has as many. Throws Error(INVALID_ARGUMENT) if it is
// NULL.
template <class Value, class Number>
void copyArray(const std::vector<Value>& values, Number* to, const char* name) {
    needArray(to, values.size(), name);
    if (!values.empty()) std::memcpy(to, values.data(), values.size() * sizeof(Value));
}

// Copies light to the caller's array of 3 * `count` floats. Throws Error(INVALID_ARGUMENT) if the
// array is NULL or has another length.
void copyLight(const std::vector<glm::vec3>& light, float* rgb, size_t count);

// Copies the arrays of rb_add_mesh into a Mesh. Throws Error(INVALID_ARGUMENT) if an array is NULL
// or too long. Scene::addMesh checks the indices.
Mesh makeMesh(const char* name, const float* vertices, size_t vertexCount,
              const int32_t* cornerVertices, size_t cornerCount, const int32_t* faceOffsets,
              size_t faceCount);

}  // namespace raybundle
