// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/left_out_corners.h"

#include <algorithm>

#include "job/cancellation.h"

namespace raybundle {
namespace {

using Values = std::vector<glm::vec3>;

// Calls act(values) for each field of light of an instance: those of all sources and of each set.
template <class Act>
void forEachField(InstanceLight& light, const Act& act) {
    auto ofOne = [&](CornerLight& one) {
        for (Values* values : {&one.direct, &one.indirect, &one.exitance}) act(*values);
    };
    ofOne(light);
    for (CornerLight& set : light.sets) ofOne(set);
}

// Gives each corner without light the mean of the corners with light (`known`, per corner) at its
// vertex, weighted by their angles.
void spreadAtVertices(const std::vector<bool>& known, InstanceLight& light) {
    auto spread = [&](auto& values) {
        using Value = std::decay_t<decltype(values[0])>;
        std::vector<Value> sum(light.vertexCount, Value(0));
        std::vector<float> weight(light.vertexCount, 0.0f);
        for (size_t c = 0; c < values.size(); ++c) {
            throwIfCancelledAt(c);
            if (!known[c]) continue;
            sum[size_t(light.cornerVertices[c])] += light.cornerAngles[c] * values[c];
            weight[size_t(light.cornerVertices[c])] += light.cornerAngles[c];
        }
        for (size_t c = 0; c < values.size(); ++c) {
            throwIfCancelledAt(c);
            const size_t v = size_t(light.cornerVertices[c]);
            if (!known[c] && weight[v] > 0) values[c] = sum[v] / weight[v];
        }
    };
    forEachField(light, spread);
    spread(light.error);
}

}  // namespace

void fillLeftOutCorners(const Patches& patches, const std::vector<InstanceRange>& ranges,
                        std::vector<InstanceLight>& light, Report& report) {
    std::vector<std::vector<bool>> known(light.size());
    for (size_t i = 0; i < light.size(); ++i) {
        throwIfCancelledAt(i);
        if (light[i].direct.empty()) continue;
        known[i].assign(light[i].direct.size(), false);
        for (uint32_t p = ranges[i].firstParent; p < ranges[i].lastParent; ++p)
            for (int32_t corner : patches.cells[patches.parents[p].cell].corner)
                if (corner >= 0) known[i][size_t(corner)] = true;
    }
    for (auto it = patches.doubledCorners.rbegin(); it != patches.doubledCorners.rend(); ++it) {
        const DoubledCorner& corner = *it;
        if (known[corner.instance].empty() || known[corner.ofInstance].empty()) continue;
        const InstanceLight& from = light[corner.ofInstance];
        InstanceLight& to = light[corner.instance];
        std::vector<const Values*> values;
        forEachField(light[corner.ofInstance], [&](Values& field) { values.push_back(&field); });
        size_t next = 0;
        forEachField(
            to, [&](Values& field) { field[corner.corner] = (*values[next++])[corner.ofCorner]; });
        to.error[corner.corner] = from.error[corner.ofCorner];
        known[corner.instance][corner.corner] = true;
        if (ranges[corner.instance].lastParent == 0)
            report.objects[corner.instance].error = report.objects[corner.ofInstance].error;
    }
    for (size_t i = 0; i < light.size(); ++i)
        if (std::find(known[i].begin(), known[i].end(), false) != known[i].end())
            spreadAtVertices(known[i], light[i]);
}

}  // namespace raybundle
