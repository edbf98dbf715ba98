// SPDX-License-Identifier: GPL-3.0-or-later
#include "job/warning.h"

#include <iterator>

namespace raybundle {
namespace {

// Names in the order of WarningId.
constexpr const char* kNames[] = {
    "CLAMPED_REFLECTANCE", "BLACK_PIXELS",        "DEGENERATE_FACES", "DOUBLED_FACES",
    "UNCUT_CROSSINGS",     "FEWER_THREADS",       "NO_FACES",         "NO_LIGHT",
    "DARK_LIGHT_SET",      "BLOCKS_AS_THE_WORLD", "NO_EXCHANGE",      "NO_TRANSLUCENCE",
    "NO_ANGLES",           "UNCUT_GAPS",          "FEW_LINES",        "DIRECT_NOISE",
    "MAX_BUNDLES",         "UNCOUNTABLE_LINES",   "MEMORY_LIMIT",     "BROKEN_CYCLES",
    "WRONG_EXCHANGES",     "UNSETTLED_EXCHANGE",  "ENERGY_BALANCE",   "UNSOLVED_FIT",
    "NO_LIGHT_ON_SIDE",    "NOISY_OBJECTS",       "COARSE_MESH",
    "MAX_VERTICES",        "MAX_PATCHES"};
static_assert(std::size(kNames) == size_t(WarningId::MAX_PATCHES) + 1);

}  // namespace

const char* nameOf(WarningId id) { return kNames[size_t(id)]; }

}  // namespace raybundle
