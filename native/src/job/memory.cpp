// SPDX-License-Identifier: GPL-3.0-or-later
#include "job/memory.h"

#ifdef _WIN32
#include <windows.h>  // declares the types that psapi.h uses

#include <psapi.h>
#else
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#endif

#include <algorithm>
#include <string>

namespace raybundle {
namespace {

// Share of the computer's memory that a bake may take if no limit is set.
constexpr double kShare = 0.75;
// Share of a bake's memory that is for exchanges.
constexpr double kOfExchanges = 0.5;
// Memory that every bake may take, in bytes. The first bake of a process takes about 50 MB in a
// small room, most of it for threads and libraries.
constexpr size_t kForAnyBake = 256'000'000;

#ifdef _WIN32

PROCESS_MEMORY_COUNTERS counters() {
    PROCESS_MEMORY_COUNTERS result{};
    GetProcessMemoryInfo(GetCurrentProcess(), &result, sizeof(result));
    return result;
}

#else

// Returns the memory that the control group of this process (version 2) and those that contain it
// allow, in bytes, or SIZE_MAX.
size_t controlGroupLimit() {
    size_t least = SIZE_MAX;
    std::string line;
    for (std::ifstream groups("/proc/self/cgroup"); std::getline(groups, line);) {
        if (line.rfind("0::", 0) != 0) continue;
        for (std::string group = line.substr(3);; group.resize(group.rfind('/'))) {
            size_t bytes = 0;  // the file has the word "max" if there is no limit
            if (std::ifstream("/sys/fs/cgroup" + group + "/memory.max") >> bytes)
                least = std::min(least, bytes);
            if (group.find('/') == std::string::npos) break;
        }
    }
    return least;
}

#endif

}  // namespace

#ifdef _WIN32

size_t residentMemory() { return counters().WorkingSetSize; }

size_t peakResidentMemory() { return counters().PeakWorkingSetSize; }

size_t computersMemory() {
    MEMORYSTATUSEX status{};
    status.dwLength = sizeof(status);
    GlobalMemoryStatusEx(&status);
    return size_t(status.ullTotalPhys);
}

#else

size_t residentMemory() {
    size_t pages = 0;
    if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
        if (std::fscanf(file, "%*u %zu", &pages) != 1) pages = 0;
        std::fclose(file);
    }
    return pages * size_t(sysconf(_SC_PAGESIZE));
}

size_t peakResidentMemory() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return size_t(usage.ru_maxrss) * 1024;
}

size_t computersMemory() {
    const size_t physical = size_t(sysconf(_SC_PHYS_PAGES)) * size_t(sysconf(_SC_PAGESIZE));
    return std::min(physical, controlGroupLimit());
}

#endif

MemoryLimit::MemoryLimit(float megabytes) : isAutomatic(megabytes <= 0) {
    const double bytes = isAutomatic ? kShare * double(computersMemory()) : double(megabytes) * 1e6;
    whole = std::max(size_t(bytes), kForAnyBake);
    exchanges = size_t(kOfExchanges * bytes);
}

Error MemoryLimit::reached() const {
    const std::string size = std::to_string(whole / 1'000'000);
    if (isAutomatic)
        return {RB_ERROR_OUT_OF_MEMORY,
                "the bake needs more than three quarters of this computer's memory (" + size +
                    " MB); set memory_limit to allow more, reduce max_patches, or bake fewer "
                    "objects or simpler meshes at once"};
    return {RB_ERROR_OUT_OF_MEMORY,
            "the bake needs more memory than memory_limit allows (" + size +
                " MB); raise memory_limit, reduce max_patches, or bake fewer objects or simpler "
                "meshes at once"};
}

}  // namespace raybundle
