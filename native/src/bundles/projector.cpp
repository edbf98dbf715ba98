// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/projector.h"

namespace raybundle {
namespace {

struct Kind {
    ProjectorKind value;
    std::unique_ptr<Projector> (*make)(const ProjectorInput& input);
};

constexpr Kind kKinds[] = {
    {ProjectorKind::AUTO, fragmentLists}, {ProjectorKind::FRAGMENT_LISTS, fragmentLists},
    {ProjectorKind::PAINTER, painter},    {ProjectorKind::PAINTER_NEWELL, painterNewell},
    {ProjectorKind::PLANE, plane},        {ProjectorKind::PLANES, planes},
};
static_assert(hasEveryValue(kKinds));

}  // namespace

std::unique_ptr<Projector> makeProjector(ProjectorKind kind, const ProjectorInput& input) {
    return input.singleLine ? singleLine(input) : kKinds[size_t(kind)].make(input);
}

}  // namespace raybundle
