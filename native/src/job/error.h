// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdexcept>
#include <string>

#include "raybundle/raybundle.h"

namespace raybundle {

// The one exception type that crosses modules: a code for the caller's program and a message for
// the user, which names the object concerned. Our own mistakes are assertions, not Errors.
class Error : public std::runtime_error {
  public:
    Error(rb_error code, const std::string& message) : std::runtime_error(message), code(code) {}

    const rb_error code;
};

// What the user gave cannot be used as it is.
inline Error invalidArgument(const std::string& message) {
    return Error(RB_ERROR_INVALID_ARGUMENT, message);
}

}  // namespace raybundle
