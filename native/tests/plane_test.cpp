// SPDX-License-Identifier: GPL-3.0-or-later
//
// PLANE and PLANES against the exact lists: the expected lines of each pair are equal.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "bundles/projector.h"
#include "test_bakes.h"
#include "test_scenes.h"
#include "transport/line_reuse.h"
#include "visibility/visibility.h"

namespace raybundle {
namespace {

using namespace test;

// A projector of the table, with its settings.
struct Kind {
    ProjectorKind row;
    int planeCount;
    PlanePlacement placement;
};
const Kind kKinds[] = {{ProjectorKind::PLANE, 1, PlanePlacement::SYSTEMATIC},
                       {ProjectorKind::PLANES, 4, PlanePlacement::SYSTEMATIC},
                       {ProjectorKind::PLANES, 4, PlanePlacement::STRATIFIED},
                       {ProjectorKind::PLANES, 4, PlanePlacement::CLOSE_DISTANCE}};

std::string nameOf(const Kind& kind) {
    return std::string(choiceName(kind.row)) + " " + std::to_string(kind.planeCount) +
           " placement " + std::to_string(int(kind.placement));
}

// Patches of a scene and projectors for them.
struct Scenery {
    Scenery(const Scene& scene, float patchSize, float pixelSize)
        : patches(subdivide(scene, patchSize, kMany)), visibility(patches), pixelSize(pixelSize) {}

    std::unique_ptr<Projector> projector(const Kind& kind, bool coherence = true) const {
        ProjectorInput input{patches, visibility, pixelSize};
        input.planeCount = kind.planeCount;
        input.planePlacement = kind.placement;
        input.planeCoherence = coherence;
        return makeProjector(kind.row, input);
    }
    std::unique_ptr<Projector> lists() const {
        return projector({ProjectorKind::FRAGMENT_LISTS, 1, PlanePlacement::SYSTEMATIC});
    }
    uint32_t instanceOf(uint32_t side) const {
        return patches.parents[patches.parentOf[side / 2]].instance;
    }

    const Patches patches;
    const Visibility visibility;
    const float pixelSize;
};

// The lines of a bundle, counted in a few groups.
using Groups = std::vector<double>;
using Group = std::function<int(uint32_t i, uint32_t j)>;  // -1: none
constexpr uint32_t kSky = UINT32_MAX;                      // as j

Groups countGroups(Projector& projector, const Bundle& bundle, size_t groups, const Group& group) {
    BundleLines lines;
    projector.project(bundle, lines);
    Groups counts(groups, 0.0);
    auto add = [&](uint32_t i, uint32_t j, uint32_t n) {
        if (const int g = group(i, j); g >= 0) counts[size_t(g)] += n;
    };
    for (const Exchange& e : lines.exchanges) add(e.i, e.j, e.lines);
    for (uint32_t side : lines.sky) add(side, kSky, 1);
    return counts;
}

// Expects that a projector finds on average as many lines in each group as the lists. Both project
// the same bundles, so that only the random choices of the planes differ. The tolerance is four
// standard errors, measured over the bundles. The standard errors must be below `most`, relative to
// the mean of the group, for the test to be significant.
void expectSameLines(const Scenery& scenery, const Kind& kind, uint32_t bundleCount, size_t groups,
                     const Group& group, double most) {
    const auto exact = scenery.lists(), found = scenery.projector(kind);
    Groups mean(groups, 0.0), difference(groups, 0.0), squares(groups, 0.0);
    for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 5).next(bundleCount)) {
        const Groups a = countGroups(*exact, bundle, groups, group);
        const Groups b = countGroups(*found, bundle, groups, group);
        for (size_t g = 0; g < groups; ++g) {
            mean[g] += a[g] / bundleCount;
            difference[g] += (b[g] - a[g]) / bundleCount;
            squares[g] += (b[g] - a[g]) * (b[g] - a[g]) / bundleCount;
        }
    }
    for (size_t g = 0; g < groups; ++g) {
        ASSERT_GT(mean[g], 0) << "group " << g;
        const double error =
            std::sqrt((squares[g] - difference[g] * difference[g]) / (bundleCount - 1));
        EXPECT_LT(error, most * mean[g]) << nameOf(kind) << ", group " << g;
        EXPECT_LT(std::abs(difference[g]), 4 * error)
            << nameOf(kind) << ", group " << g << ", mean " << mean[g];
    }
}

Scene twoPlates() {
    Scene scene;
    place(scene, rectangle("low", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0));
    place(scene, rectangle("high", {0, 0, 1}, {0, 1, 0}, {1, 0, 0}), grey("", 0));
    return scene;
}

TEST(Planes, TwoPlatesExchangeAsInTheListsAndSeeTheSky) {
    const Scenery scenery(twoPlates(), 0.25f, 0.05f);
    for (const Kind& kind : kKinds)
        expectSameLines(
            scenery, kind, 3000, 5,
            [&](uint32_t i, uint32_t j) {
                if (j != kSky) return 0;
                return 1 + 2 * int(scenery.instanceOf(i)) + int(i % 2);
            },
            0.05);
}

TEST(Planes, BoxesInARoomExchangeAsInTheLists) {
    const Scenery scenery(roomWithBoxes(0.5f), 0.4f, 0.08f);
    // Only parts whose gaps do not go down to zero. The gaps of walls with a common edge do, and
    // the weights of such pairs have no finite variance and thus no confidence interval.
    auto group = [&](uint32_t i, uint32_t j) {
        if (j == kSky) return scenery.instanceOf(i) == 0 && i % 2 == 1 ? 0 : -1;
        const uint32_t a = scenery.instanceOf(i), b = scenery.instanceOf(j);
        if (i % 2 || j % 2) return -1;
        if (a == 0 && b == 0) {
            const glm::vec3 n = scenery.patches.normal(i), m = scenery.patches.normal(j);
            return glm::dot(n, m) < -0.5f ? 1 : -1;
        }
        return a == b ? -1 : 1 + int(a + b);
    };
    // One plane seldom lies between the boxes.
    for (const Kind& kind : kKinds)
        expectSameLines(scenery, kind, 800, 5, group, kind.planeCount == 1 ? 0.25 : 0.1);
}

TEST(Planes, TheFormFactorOfTwoPlatesIsItsClosedForm) {
    const Scenery scenery(twoPlates(), 0.25f, 0.05f);
    const double wanted = parallelRectangles(1, 1, 1);
    for (const Kind& kind : kKinds) {
        const auto projector = scenery.projector(kind);
        LineCounts counts(scenery.patches.sideCount());
        std::vector<TracedBundle> traced;
        for (const Bundle& bundle : Directions(DirectionKind::LOW_DISCREPANCY, 2).next(2000)) {
            traced.push_back({bundle, {}});
            projector->project(bundle, traced.back().lines);
        }
        counts.add(traced);
        // If the single plane lies between the plates, all lines of a bundle are found, else none:
        // the standard error with 2000 bundles is 1.8 % for PLANE, less for more planes. The
        // tolerance is three standard errors.
        EXPECT_NEAR(formFactor(scenery.patches, counts, 0, 1), wanted, 0.055 * wanted)
            << nameOf(kind);
        // Crofton: m_i = n A / (2 s^2).
        double lines = 0;
        for (uint32_t side = 0; side < scenery.patches.sideCount(); ++side)
            lines += linesOf(counts, side);
        EXPECT_NEAR(lines * 2 * 0.05 * 0.05 / (2000 * 4), 1, 0.03) << nameOf(kind);
    }
}

void expectEqual(const BundleLines& a, const BundleLines& b) {
    EXPECT_EQ(a.lines, b.lines);
    EXPECT_EQ(a.sky, b.sky);
    ASSERT_EQ(a.exchanges.size(), b.exchanges.size());
    for (size_t k = 0; k < a.exchanges.size(); ++k) {
        ASSERT_EQ(a.exchanges[k].i, b.exchanges[k].i);
        ASSERT_EQ(a.exchanges[k].j, b.exchanges[k].j);
        ASSERT_EQ(a.exchanges[k].lines, b.exchanges[k].lines);
    }
}

TEST(Planes, CoherenceChangesNothing) {
    for (float gap : {0.1f, 0.0f}) {  // the standing boxes have surfaces that coincide
        const Scenery scenery(roomWithBoxes(0.5f, 0, gap), 0.3f, 0.06f);
        for (PlanePlacement placement : {PlanePlacement::SYSTEMATIC, PlanePlacement::STRATIFIED,
                                         PlanePlacement::CLOSE_DISTANCE})
            for (int planeCount : {1, 4, 13}) {
                const Kind kind{ProjectorKind::PLANES, planeCount, placement};
                const auto with = scenery.projector(kind, true),
                           without = scenery.projector(kind, false);
                for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 3).next(6)) {
                    BundleLines a, b;
                    with->project(bundle, a);
                    without->project(bundle, b);
                    EXPECT_GT(a.lines, 0u);
                    expectEqual(a, b);
                }
            }
    }
}

TEST(Planes, LinesThatMeetTheSceneAreThoseOfTheLists) {
    const Scenery scenery(roomWithBoxes(0.5f), 0.3f, 0.06f);
    const auto exact = scenery.lists();
    for (const Kind& kind : kKinds) {
        const auto projector = scenery.projector(kind);
        for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 6).next(8)) {
            BundleLines wanted, found;
            exact->project(bundle, wanted);
            projector->project(bundle, found);
            EXPECT_EQ(found.lines, wanted.lines);
        }
    }
}

TEST(Planes, NothingShinesBetweenSurfacesThatTouch) {
    // Boxes that stand on the floor. Their bottoms and the covered floor exchange nothing, and no
    // light of the room leaks between them.
    const Scenery scenery(roomWithBoxes(0.5f, 0, 0), 0.3f, 0.05f);
    for (const Kind& kind :
         {kKinds[0], kKinds[2], Kind{ProjectorKind::PLANES, 40, PlanePlacement::SYSTEMATIC},
          Kind{ProjectorKind::PLANES, 40, PlanePlacement::CLOSE_DISTANCE}}) {
        const auto projector = scenery.projector(kind);
        uint64_t all = 0, leaks = 0;
        for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 7).next(100)) {
            BundleLines lines;
            projector->project(bundle, lines);
            for (const Exchange& e : lines.exchanges) {
                all += e.lines;
                if (e.i % 2 != e.j % 2) leaks += e.lines;
                for (uint32_t side : {e.i, e.j}) {
                    const bool isUnderside = scenery.instanceOf(side) > 0 && side % 2 == 0 &&
                                             scenery.patches.normal(side).z < -0.9f;
                    ASSERT_FALSE(isUnderside) << "between " << e.i << " and " << e.j;
                }
            }
        }
        // As in FragmentLists.NoLineLeavesAClosedScene: within a rounding error of an edge the
        // order of its two faces is undefined.
        EXPECT_LE(double(leaks), 5e-6 * double(all)) << nameOf(kind);
    }
}

TEST(Planes, OneFlatSurfaceSeesOnlyTheSky) {
    Scene scene;
    place(scene, rectangle("plate", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0));
    const Scenery scenery(scene, 10, 0.1f);
    for (const Kind& kind : kKinds) {
        const auto projector = scenery.projector(kind);
        double front = 0, back = 0;
        constexpr uint32_t kBundles = 4000;
        for (uint32_t index = 0; index < kBundles; ++index) {
            // Head-on: the scene has no depth.
            BundleLines lines;
            projector->project({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.3, 0.7}, 0, index}, lines);
            EXPECT_EQ(lines.lines, 100u);
            EXPECT_TRUE(lines.exchanges.empty());
            const auto fronts = std::count(lines.sky.begin(), lines.sky.end(), 0u);
            front += double(fronts) / kBundles;
            back += double(lines.sky.size() - size_t(fronts)) / kBundles;
        }
        // Each side is found by at least half of the planes, with two lines. The tolerance is four
        // standard errors.
        EXPECT_NEAR(front, 100, 400 / std::sqrt(kBundles)) << nameOf(kind);
        EXPECT_NEAR(back, 100, 400 / std::sqrt(kBundles)) << nameOf(kind);
    }
}

TEST(Planes, CloseDistanceFindsContactsWithLessNoise) {
    // The light between boxes and the floor 10 cm below them.
    const Scenery scenery(roomWithBoxes(0.5f), 0.4f, 0.08f);
    auto underside = [&](uint32_t i, uint32_t j) {
        if (j == kSky) return -1;
        auto isUnderside = [&](uint32_t side) {
            return scenery.instanceOf(side) > 0 && side % 2 == 0 &&
                   scenery.patches.normal(side).z < -0.9f;
        };
        return isUnderside(i) || isUnderside(j) ? 0 : -1;
    };
    constexpr uint32_t kBundles = 600;
    double squares[2] = {0, 0};
    const auto exact = scenery.lists();
    const auto systematic =
        scenery.projector({ProjectorKind::PLANES, 16, PlanePlacement::SYSTEMATIC});
    const auto close =
        scenery.projector({ProjectorKind::PLANES, 16, PlanePlacement::CLOSE_DISTANCE});
    for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 8).next(kBundles)) {
        const double wanted = countGroups(*exact, bundle, 1, underside)[0];
        for (int k = 0; k < 2; ++k) {
            Projector& projector = k == 0 ? *systematic : *close;
            const double lines = countGroups(projector, bundle, 1, underside)[0];
            squares[k] += (lines - wanted) * (lines - wanted) / kBundles;
        }
    }
    // Measured: about an eighth of the variance.
    EXPECT_LT(squares[1], 0.5 * squares[0]);
}

TEST(Planes, FurnacesAreExact) {
    for (const Kind& kind : kKinds) {
        const Scene scene = roomWithBoxes(0.5f, 0.5f);
        Bake bake;
        // Enough bundles for lines of both halves to meet all sides. (The solver stops at a share
        // of the stated error, and a side that no line of a half met adds to this error.)
        setQuick(bake, 512);
        bake.settings.contacts = 0;
        bake.settings.projector = kind.row;
        bake.settings.planePlacement = kind.placement;
        bake.run(scene);
        double worst = 0;
        for (int32_t i = 0; i < 3; ++i)
            for (rb_output output : {RB_OUTPUT_COMBINED, RB_OUTPUT_LIGHTING})
                for (const glm::vec3& v : cornerLight(bake, i, output))
                    worst = std::max(worst, std::abs(double(v.x) * kPi - 1));
        EXPECT_LT(worst, 1e-4) << nameOf(kind);
    }
}

TEST(Planes, FurnacesAreExactWhereLinesCameForAnyNumberOfBundles) {
    const Scenery scenery(roomWithBoxes(0.5f, 0.5f), 0.3f, 0.2f);
    const std::vector<float> exposed;
    FirstShot shot;
    shot.irradiance.assign(scenery.patches.sideCount(), glm::vec3(0));
    shot.emission = scenery.patches.emission;
    for (const Kind& kind : kKinds)
        for (uint32_t bundleCount : {2u, 64u}) {
            const auto projector = scenery.projector(kind);
            std::vector<TracedBundle> traced;
            for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 1).next(bundleCount)) {
                traced.push_back({bundle, {}});
                projector->project(bundle, traced.back().lines);
            }
            LineCounts counts(scenery.patches.sideCount());
            counts.add(traced);
            const LineReuse solver(scenery.patches, counts, shot, glm::vec3(0), exposed);
            std::vector<glm::vec3> reflected(scenery.patches.sideCount(), glm::vec3(0));
            const Irradiance h = solver.solve(Half::BOTH, 1e-6f, reflected);
            for (uint32_t i = 0; i < scenery.patches.sideCount(); i += 2)
                if (linesOf(counts, i) > 0) {
                    ASSERT_NEAR(h.direct[i].x + h.indirect[i].x, 1, 1e-5)
                        << nameOf(kind) << ", " << bundleCount << " bundles, side " << i;
                }
        }
}

TEST(Planes, TheResultDoesNotDependOnThreadsOrCoherence) {
    const Scene scene = litRoom();
    std::vector<std::vector<glm::vec3>> results;
    for (const auto& [threads, coherence] : {std::pair(1, 1), std::pair(2, 1), std::pair(2, 0)}) {
        Bake bake;
        setQuick(bake, 16);
        bake.settings.projector = ProjectorKind::PLANES;
        bake.settings.threads = threads;
        bake.settings.planeCoherence = coherence;
        bake.run(scene);
        results.push_back(everything(bake));
    }
    EXPECT_LT(difference(results[0], results[1]), 1e-5);
    EXPECT_LT(difference(results[0], results[2]), 1e-5);
}

TEST(Planes, AnEmptySceneIsNoError) {
    for (ProjectorKind projector : {ProjectorKind::PLANE, ProjectorKind::PLANES}) {
        Bake bake;
        bake.settings.projector = projector;
        bake.run(Scene());
        EXPECT_TRUE(warns(reportOf(bake), WarningId::NO_FACES));
    }
}

}  // namespace
}  // namespace raybundle
