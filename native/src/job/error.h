// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdexcept>
#include <string>

#include "raybundle/raybundle.h"

namespace raybundle {

// The only exception type that crosses module borders: an error code for the calling program, and a
// message for the user that names the object concerned. Faults of the library itself are
// assertions, not Errors.
class Error : public std::runtime_error {
  public:
    Error(rb_error code, const std::string& message) : std::runtime_error(message), code(code) {}

    const rb_error code;
};

// Returns an Error(INVALID_ARGUMENT), for input that cannot be used. The caller throws it.
inline Error invalidArgument(const std::string& message) {
    return Error(RB_ERROR_INVALID_ARGUMENT, message);
}

}  // namespace raybundle
