// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "job/error.h"

namespace raybundle::bench {

// The main function of a program with arguments: run(arguments) returns its exit code. Without
// arguments, or with --help, the usage is printed; what run throws is, and the exit code is 2.
template <class Run>
int runCommand(const char* name, const char* usage, int count, char** values, const Run& run) {
    try {
        const std::vector<std::string> arguments(values + 1, values + count);
        if (arguments.empty() || arguments[0] == "--help") {
            std::fputs(usage, stdout);
            return 0;
        }
        return run(arguments);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s: %s\n", name, error.what());
        return 2;
    }
}

// Reads arguments of the form `NAME ... --option VALUE ...`: calls takeName(name) for each name and
// takeOption(option, value) for each option. Throws Error(INVALID_ARGUMENT) for one without a
// value, and where takeOption returns false: it does not know the option.
template <class TakeName, class TakeOption>
void readArguments(const std::vector<std::string>& arguments, const TakeName& takeName,
                   const TakeOption& takeOption) {
    for (size_t a = 0; a < arguments.size(); ++a) {
        const std::string& name = arguments[a];
        if (name.rfind("--", 0) != 0) {
            takeName(name);
            continue;
        }
        if (++a == arguments.size()) throw invalidArgument(name + " needs a value");
        if (!takeOption(name, arguments[a])) throw invalidArgument("there is no option " + name);
    }
}

}  // namespace raybundle::bench
