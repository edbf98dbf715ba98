// SPDX-License-Identifier: GPL-3.0-or-later
//
// What callers hold. A handle is a number that is never given twice and no address: one that was
// released, is of another kind or was never given is told from one that is open, and a call finds
// out that another one is not done with it.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>

#include "job/error.h"

namespace raybundle {

// The handle after the last one that was given, of whatever kind.
uintptr_t nextHandle();

// The open handles (rb_scene, ...) of one kind and what each stands for.
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

    // Does nothing with a handle that is not open. One that a call is at work with goes when that
    // call is done.
    static void release(Handle handle) noexcept {
        Handles& all = instance();
        std::unique_ptr<Value> last;  // goes outside of the lock
        const std::lock_guard lock(all.mutex);
        const auto slot = all.slots.find(handle);
        if (slot == all.slots.end()) return;
        slot->second.isReleased = true;
        if (!slot->second.isInUse) last = all.remove(slot);
    }

    // Of Held. Throws INVALID_ARGUMENT for a handle that is not open, INVALID_OPERATION for one
    // that is in use.
    static Value& take(Handle handle, const char* name) {
        if (!handle) throw invalidArgument(std::string(name) + " must not be NULL");
        Handles& all = instance();
        const std::lock_guard lock(all.mutex);
        const auto slot = all.slots.find(handle);
        if (slot == all.slots.end() || slot->second.isReleased)
            throw invalidArgument(std::string(name) + " was released, or is no " + name);
        if (slot->second.isInUse)
            throw Error(RB_ERROR_INVALID_OPERATION,
                        std::string("another call that uses this ") + name + " is not done");
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

    // Never destroyed: what the caller did not release must not go when the program ends, after
    // what it is made of.
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

// What a handle stands for, for one call alone.
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
