// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/projector.h"

#include <algorithm>
#include <cassert>

namespace raybundle {
namespace {

struct Kind {
    const char* name;
    std::unique_ptr<Projector> (*make)(const ProjectorInput& input);
};

constexpr Kind kKinds[] = {
    {"AUTO", fragmentLists}, {"FRAGMENT_LISTS", fragmentLists},
    {"PAINTER", painter},    {"PAINTER_NEWELL", painterNewell},
    {"PLANE", plane},        {"PLANES", planes},
};

}  // namespace

std::unique_ptr<Projector> makeProjector(const std::string& kind, const ProjectorInput& input) {
    const auto row = std::find_if(std::begin(kKinds), std::end(kKinds),
                                  [&](const Kind& k) { return kind == k.name; });
    assert(row != std::end(kKinds) && "settings know the names");
    return input.singleLine ? singleLine(input) : row->make(input);
}

}  // namespace raybundle
