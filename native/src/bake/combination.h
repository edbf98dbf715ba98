// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "bake/settings.h"

namespace raybundle {

// Throws Error(INVALID_ARGUMENT) with the reason where the methods that the settings name do not
// work together. Table: docs/method.md.
void checkCombination(const Settings& settings);

}  // namespace raybundle
