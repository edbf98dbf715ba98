// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "job/error.h"

namespace raybundle::bench {

// Runs the main function of a program with arguments. run(arguments) returns the exit code. Without
// arguments, or with --help, prints the usage. If `run` throws, prints the message and returns 2.
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

// Reads arguments of the form `NAME ... --option VALUE ...`. Calls takeName(name) for each name and
// takeOption(option, value) for each option. Throws Error(INVALID_ARGUMENT) if an option has no
// value, or if takeOption returns false because the option does not exist.
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
