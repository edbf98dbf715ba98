// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "job/settings.h"

namespace raybundle {

// Throws Error(INVALID_ARGUMENT) with the reason if the methods chosen in `settings` do not work
// together, or if the solver cannot keep light sets apart although `lightSetCount` > 0. The table
// of combinations is in docs/method.md.
void checkCombination(const Settings& settings, size_t lightSetCount);

}  // namespace raybundle
