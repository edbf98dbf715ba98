// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/parent_groups.h"

#include <algorithm>
#include <array>

namespace raybundle {
namespace {

// An object whose area is less than this share of the surface of its box is dust or wires. Such an
// object gathers by local rays.
constexpr double kLeastFilled = 1e-3;
// Starved patches whose area is less than this share of their object's area get no windows.
constexpr double kCrumbs = 1e-3;
// Cost of a window besides its own pixels, in pixels, which is the time to test whether parents
// meet it: fixed, and per parent.
constexpr double kWindowCost = 500, kParentCost = 1.0 / 32;
constexpr double kWorthSplitting = 0.97;  // splitting must reduce the cost to less than this share
constexpr int kBins = 16;

}  // namespace

ParentGroups::ParentGroups(const Patches& patches)
    : patches(patches), boxes(patches.parents.size()) {
    for (size_t i = 0; i < boxes.size(); ++i) {
        const Parent& parent = patches.parents[i];
        const glm::vec3 origin = patches.axes * parent.origin, a = patches.axes * parent.a,
                        b = patches.axes * parent.b;
        boxes[i].add(origin);
        boxes[i].add(origin + a);
        boxes[i].add(origin + b);
        if (!parent.isTriangle) boxes[i].add(origin + a + b);
    }
}

size_t ParentGroups::patchCount(const ParentGroup& members) const {
    size_t count = 0;
    for (uint32_t m : members) count += patches.parents[m].patchCount();
    return count;
}

WindowBox ParentGroups::boxOf(const ParentGroup& members) const {
    WindowBox box;
    for (uint32_t m : members) box.add(boxes[m]);
    return box;
}

std::vector<ParentGroup> ParentGroups::split(ParentGroup members, double pixelArea,
                                             size_t mostGroups) const {
    std::vector<ParentGroup> open{std::move(members)}, done;
    while (!open.empty()) {
        ParentGroup group = std::move(open.back());
        open.pop_back();
        ParentGroup part;
        if (open.size() + done.size() + 2 <= mostGroups && cut(group, part, pixelArea)) {
            open.push_back(std::move(part));
            open.push_back(std::move(group));
        } else {
            done.push_back(std::move(group));
        }
    }
    return done;
}

double ParentGroups::cost(const WindowBox& box, double pixelArea) const {
    return box.meanRectangle() / pixelArea + kWindowCost + kParentCost * double(boxes.size());
}

// Moves a part of `group` to `part` if two windows cost less than one. Returns whether it did.
bool ParentGroups::cut(ParentGroup& group, ParentGroup& part, double pixelArea) const {
    const WindowBox box = boxOf(group);
    double best = kWorthSplitting * cost(box, pixelArea);
    int bestAxis = -1;
    float bestPlace = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const float low = box.low[axis], width = (box.high[axis] - low) / kBins;
        if (!(width > 0)) continue;
        std::array<WindowBox, kBins> bins;
        auto binOf = [&](uint32_t m) {
            const float middle = 0.5f * (boxes[m].low[axis] + boxes[m].high[axis]);
            return std::clamp(int((middle - low) / width), 0, kBins - 1);
        };
        for (uint32_t m : group) bins[size_t(binOf(m))].add(boxes[m]);
        std::array<WindowBox, kBins> above;  // bounds of a bin and all bins above it
        above[kBins - 1] = bins[kBins - 1];
        for (size_t b = kBins - 1; b-- > 0;) {
            above[b] = above[b + 1];
            above[b].add(bins[b]);
        }
        WindowBox below;
        for (size_t b = 0; b + 1 < kBins; ++b) {
            below.add(bins[b]);
            if (below.isEmpty() || above[b + 1].isEmpty()) continue;
            const double both = cost(below, pixelArea) + cost(above[b + 1], pixelArea);
            if (both < best) {
                best = both;
                bestAxis = axis;
                bestPlace = low + float(b + 1) * width;
            }
        }
    }
    if (bestAxis < 0) return false;
    const auto middle = std::stable_partition(group.begin(), group.end(), [&](uint32_t m) {
        return 0.5f * (boxes[m].low[bestAxis] + boxes[m].high[bestAxis]) < bestPlace;
    });
    part.assign(middle, group.end());
    group.erase(middle, group.end());
    return !part.empty() && !group.empty();
}

ParentGroup ParentGroups::withoutDust(const ParentGroup& members) const {
    std::vector<WindowBox> box;  // per instance
    std::vector<double> area;
    for (uint32_t m : members) {
        const Parent& parent = patches.parents[m];
        if (parent.instance >= box.size()) {
            box.resize(parent.instance + 1);
            area.resize(parent.instance + 1, 0.0);
        }
        box[parent.instance].add(boxes[m]);
        area[parent.instance] += this->area(m);
    }
    ParentGroup rest;
    for (uint32_t m : members)
        if (const uint32_t i = patches.parents[m].instance;
            area[i] > kLeastFilled * 4 * box[i].meanShadow())
            rest.push_back(m);
    return rest;
}

ParentGroup ParentGroups::withoutCrumbs(const ParentGroup& members, double starvedArea) const {
    auto isStarved = [&](const Parent& parent) {
        return double(patches.area[parent.firstPatch]) < starvedArea;
    };
    std::vector<double> areas, starved;  // per instance
    for (uint32_t m : members) {
        const Parent& parent = patches.parents[m];
        if (parent.instance >= areas.size()) {
            areas.resize(parent.instance + 1, 0.0);
            starved.resize(parent.instance + 1, 0.0);
        }
        areas[parent.instance] += area(m);
        if (isStarved(parent)) starved[parent.instance] += area(m);
    }
    ParentGroup rest;
    for (uint32_t m : members) {
        const Parent& parent = patches.parents[m];
        if (!isStarved(parent) || starved[parent.instance] > kCrumbs * areas[parent.instance])
            rest.push_back(m);
    }
    return rest;
}

}  // namespace raybundle
