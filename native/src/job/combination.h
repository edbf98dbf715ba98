// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "job/settings.h"

namespace raybundle {

// Throws Error(INVALID_ARGUMENT) with the reason where the methods that the settings name do not
// work together, or do not carry several light sets. Table: docs/method.md.
void checkCombination(const Settings& settings, size_t lightSetCount);

}  // namespace raybundle
