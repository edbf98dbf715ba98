// SPDX-License-Identifier: GPL-3.0-or-later
//
// Handles of the C interface. A handle is a number that is used only once, not an address. The
// library can therefore detect a handle that was released, belongs to another kind or never
// existed, and a second call on a handle whose first call is still running.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>

#include "job/error.h"

namespace raybundle {

// Returns a new handle value. All kinds of handles share one counter.
uintptr_t nextHandle();

// The open handles of one kind (rb_scene, rb_bake, ...) and the value that each stands for.
template <class Handle, class Value>
class Handles {
  public:
    static Handle add(std::unique_ptr<Value> value) {
        Handles& all = instance();
        const std::lock_guard lock(all.mutex);
        const auto handle = reinterpret_cast<Handle>(nextHandle());
        all.slots[handle].value = std::move(value);
        return handle;
    }

    // Releases a handle. If a call is using the handle, its value is destroyed when that call ends.
    // Does nothing if the handle is not open.
    static void release(Handle handle) noexcept {
        Handles& all = instance();
        std::unique_ptr<Value> last;  // destroyed after the lock is released
        const std::lock_guard lock(all.mutex);
        const auto slot = all.slots.find(handle);
        if (slot == all.slots.end()) return;
        slot->second.isReleased = true;
        if (!slot->second.isInUse) last = all.remove(slot);
    }

    // Marks a handle as in use and returns its value. Called by Held only. Throws
    // Error(INVALID_ARGUMENT) if the handle is not open and Error(INVALID_OPERATION) if another
    // call is using it.
    static Value& take(Handle handle, const char* name) {
        if (!handle) throw invalidArgument(std::string(name) + " must not be NULL");
        Handles& all = instance();
        const std::lock_guard lock(all.mutex);
        const auto slot = all.slots.find(handle);
        if (slot == all.slots.end() || slot->second.isReleased)
            throw invalidArgument(std::string(name) + " was released, or is not a handle of a " +
                                  name);
        if (slot->second.isInUse)
            throw Error(RB_ERROR_INVALID_OPERATION,
                        std::string("another call is still using this ") + name);
        slot->second.isInUse = true;
        return *slot->second.value;
    }
    static void giveBack(Handle handle) noexcept {
        Handles& all = instance();
        std::unique_ptr<Value> last;
        const std::lock_guard lock(all.mutex);
        const auto slot = all.slots.find(handle);
        slot->second.isInUse = false;
        if (slot->second.isReleased) last = all.remove(slot);
    }

  private:
    struct Slot {
        std::unique_ptr<Value> value;
        bool isInUse = false, isReleased = false;
    };
    using Slots = std::unordered_map<Handle, Slot>;

    // The map is never destroyed. Values that the caller did not release would otherwise be
    // destroyed at the end of the program, possibly after static objects that they depend on.
    static Handles& instance() {
        static Handles* const all = new Handles;
        return *all;
    }

    std::unique_ptr<Value> remove(typename Slots::iterator slot) {
        std::unique_ptr<Value> value = std::move(slot->second.value);
        slots.erase(slot);
        return value;
    }

    std::mutex mutex;
    Slots slots;
};

// The value of a handle, reserved for one call. The destructor makes the handle available again.
template <class Handle, class Value>
class Held {
  public:
    Held(Handle handle, const char* name)
        : handle(handle), value(Handles<Handle, Value>::take(handle, name)) {}
    ~Held() { Handles<Handle, Value>::giveBack(handle); }
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;

    Value& operator*() const { return value; }
    Value* operator->() const { return &value; }

  private:
    const Handle handle;
    Value& value;
};

}  // namespace raybundle
