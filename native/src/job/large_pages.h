// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace raybundle {

// Reserves room for `count` elements, and asks the system to map it in large pages. The first write
// to each page of 4 kB takes about a microsecond, which is most of the time of a large vector that
// is written once. Does nothing more than reserve() where the system has no such pages.
template <class T>
void reserveInLargePages(std::vector<T>& values, size_t count) {
    values.reserve(count);
#if defined(__linux__) && defined(MADV_HUGEPAGE)
    constexpr uintptr_t kPage = 4096;
    const auto begin = reinterpret_cast<uintptr_t>(values.data());
    const uintptr_t first = (begin + kPage - 1) / kPage * kPage,
                    last = (begin + values.capacity() * sizeof(T)) / kPage * kPage;
    if (last > first) madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
#endif
}

}  // namespace raybundle
