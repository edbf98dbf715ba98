// SPDX-License-Identifier: GPL-3.0-or-later
//
// Which methods work together, tested one by one, and the tables of them in docs/method.md.
#include "job/combination.h"

#include <gtest/gtest.h>

#include <functional>
#include <iterator>
#include <set>
#include <string>

#include "docs_page.h"
#include "job/error.h"

namespace raybundle {
namespace {

using namespace test;

// Returns why a combination is rejected, or "" if it is accepted.
std::string refusal(const Settings& settings, size_t lightSetCount = 0) {
    try {
        checkCombination(settings, lightSetCount);
        return "";
    } catch (const Error& error) {
        EXPECT_EQ(error.code, RB_ERROR_INVALID_ARGUMENT);
        return error.what();
    }
}

// Calls visit(settings) for every combination of the choices that affect lines and light.
void forEachCombination(const std::function<void(const Settings&)>& visit) {
    Settings settings;
    for (const auto& solver : kSolvers)
        for (const auto& firstShot : kFirstShots)
            for (const auto& directions : kDirectionKinds)
                for (const auto& projector : kProjectorKinds)
                    for (const auto& smallPatches : kSmallPatches) {
                        settings.solver = solver.value;
                        settings.firstShot = firstShot.value;
                        settings.directions = directions.value;
                        settings.projector = projector.value;
                        settings.smallPatches = smallPatches.value;
                        visit(settings);
                    }
}

// The methods that a solver works with in some combination.
struct Partners {
    std::set<FirstShotKind> firstShots;
    std::set<DirectionKind> directions;
    std::set<ProjectorKind> projectors;
    std::set<SmallPatches> smallPatches;

    void add(const Settings& settings) {
        firstShots.insert(settings.firstShot);
        directions.insert(settings.directions);
        projectors.insert(settings.projector);
        smallPatches.insert(settings.smallPatches);
    }
    bool include(const Settings& settings) const {
        return firstShots.count(settings.firstShot) && directions.count(settings.directions) &&
               projectors.count(settings.projector) && smallPatches.count(settings.smallPatches);
    }
};

Partners partnersOf(Solver solver) {
    Partners partners;
    forEachCombination([&](const Settings& settings) {
        if (settings.solver == solver && refusal(settings).empty()) partners.add(settings);
    });
    return partners;
}

// Returns the values as a cell of a table.
template <class Choice>
std::string listed(const std::set<Choice>& values) {
    if (values.size() == std::size(rowsOf(Choice{}))) return "all";
    std::string text;
    for (Choice value : values)
        text += (text.empty() ? "`" : ", `") + std::string(choiceName(value)) + "`";
    return text;
}

TEST(Combination, IsRefusedIfTheSolverRefusesAPartOfIt) {
    for (const SolverRow& solver : kSolvers) {
        const Partners partners = partnersOf(solver.value);
        forEachCombination([&](const Settings& settings) {
            if (settings.solver != solver.value) return;
            const std::string message = refusal(settings);
            EXPECT_EQ(message.empty(), partners.include(settings)) << message;
        });
    }
}

TEST(Combination, IsRefusedWithAReasonAndARemedy) {
    forEachCombination([](const Settings& settings) {
        const std::string message = refusal(settings);
        if (message.empty()) return;
        EXPECT_EQ(message.find(std::string("solver ") + choiceName(settings.solver)), 0u);
        const size_t why = message.find(": "), remedy = message.find("; choose ");
        ASSERT_NE(why, std::string::npos) << message;
        ASSERT_NE(remedy, std::string::npos) << message;
        EXPECT_GT(remedy, why + 20) << message;
        EXPECT_GT(message.size(), remedy + 10) << message;
    });
}

TEST(Combination, OfSingleLinesHasNoProjectorAndNoPixels) {
    forEachCombination([](Settings settings) {
        if (!refusal(settings).empty()) return;
        settings.linesPerBundle = 1;
        const bool isFree = settings.projector == ProjectorKind::AUTO &&
                            settings.smallPatches == SmallPatches::CENTRE_SAMPLING;
        EXPECT_EQ(refusal(settings).empty(), isFree) << refusal(settings);
    });
}

TEST(Combination, FollowsTheThesisWithMultipathAndEqualWeights) {
    forEachCombination([](Settings settings) {
        if (!refusal(settings).empty()) return;
        settings.thesisLiteral = 1;
        const bool isLiteral =
            settings.solver == Solver::MULTIPATH && settings.directions != DirectionKind::ADAPTIVE;
        EXPECT_EQ(refusal(settings).empty(), isLiteral) << refusal(settings);
    });
}

TEST(Combination, TableInTheDocsIsThatOfTheLibrary) {
    std::string table =
        "| solver | first shot | directions | projector | small patches | light sets |\n"
        "|---|---|---|---|---|---|\n";
    for (const SolverRow& solver : kSolvers) {
        const Partners partners = partnersOf(solver.value);
        Settings settings;
        settings.solver = solver.value;
        settings.directions = *partners.directions.begin();
        table += std::string("| `") + solver.name + "` | " + listed(partners.firstShots) + " | " +
                 listed(partners.directions) + " | " + listed(partners.projectors) + " | " +
                 listed(partners.smallPatches) + " | " +
                 (refusal(settings, 1).empty() ? "yes" : "no") + " |\n";
    }
    expectOnPage("method.md", table);
}

}  // namespace
}  // namespace raybundle
