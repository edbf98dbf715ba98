// SPDX-License-Identifier: GPL-3.0-or-later
//
// The description of the settings in the C interface agrees with what a bake accepts and holds, and
// with the table in docs/c_api.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <set>
#include <string>
#include <vector>

#include "api_fixture.h"
#include "docs_page.h"

namespace raybundle {
namespace {

using namespace test;

rb_setting_info infoOf(size_t index) {
    rb_setting_info info{};
    info.size = sizeof info;
    EXPECT_EQ(rb_get_setting_info(index, &info), RB_ERROR_NONE) << message();
    return info;
}

std::vector<rb_setting_info> allSettings() {
    std::vector<rb_setting_info> all;
    for (size_t index = 0; index < rb_get_setting_count(); ++index) all.push_back(infoOf(index));
    return all;
}

// A test with a bake that has default settings.
class ApiSettings : public ::testing::Test {
  protected:
    void SetUp() override { ASSERT_EQ(rb_new_bake(&bake), RB_ERROR_NONE); }
    void TearDown() override { rb_release_bake(bake); }

    double get(const rb_setting_info& info) {
        if (info.type == RB_SETTING_INT) {
            int32_t value = -1;
            EXPECT_EQ(rb_get_bake_int(bake, info.name, &value), RB_ERROR_NONE) << message();
            return value;
        }
        float value = -1;
        EXPECT_EQ(rb_get_bake_float(bake, info.name, &value), RB_ERROR_NONE) << message();
        return double(value);
    }
    rb_error set(const rb_setting_info& info, double value) {
        return info.type == RB_SETTING_INT ? rb_set_bake_int(bake, info.name, int32_t(value))
                                           : rb_set_bake_float(bake, info.name, float(value));
    }

    rb_bake bake = nullptr;
};

TEST_F(ApiSettings, HaveNamesOfTheirOwnAndHelp) {
    std::set<std::string> names;
    for (const rb_setting_info& info : allSettings()) {
        ASSERT_NE(info.name, nullptr);
        EXPECT_TRUE(names.insert(info.name).second) << info.name;
        EXPECT_GT(std::strlen(info.help), 10u) << info.name;
        EXPECT_EQ(std::string(info.help).find_first_of("\n|"), std::string::npos) << info.name;
        EXPECT_NE(info.help[std::strlen(info.help) - 1], '.') << info.name;
        EXPECT_NE(info.unit, nullptr) << info.name;
    }
    EXPECT_TRUE(names.count("solver") && names.count("target_error") && names.count("skip.lit"));
}

TEST_F(ApiSettings, NumbersHaveTheirDefaultAndTheirRange) {
    for (const rb_setting_info& info : allSettings()) {
        if (info.type == RB_SETTING_CHOICE) continue;
        EXPECT_EQ(get(info), info.default_number) << info.name;
        EXPECT_EQ(info.choice_count, 0u) << info.name;
        EXPECT_EQ(info.choices, nullptr) << info.name;
        EXPECT_EQ(info.default_choice, nullptr) << info.name;
        for (double end : {info.least, info.most}) {
            EXPECT_EQ(set(info, end), RB_ERROR_NONE) << info.name << ": " << message();
            EXPECT_EQ(get(info), end) << info.name;
        }
        const bool isInt = info.type == RB_SETTING_INT;
        expectInvalid(
            set(info, isInt ? info.least - 1 : double(std::nextafter(float(info.least), -1.0f))),
            info.name);
        if (isInt && info.most == double(INT32_MAX)) continue;
        expectInvalid(
            set(info, isInt ? info.most + 1 : double(std::nextafter(float(info.most), INFINITY))),
            info.name);
    }
}

TEST_F(ApiSettings, ChoicesHaveTheirDefaultAndTakeEachName) {
    for (const rb_setting_info& info : allSettings()) {
        if (info.type != RB_SETTING_CHOICE) continue;
        const char* value = nullptr;
        EXPECT_EQ(rb_get_bake_string(bake, info.name, &value), RB_ERROR_NONE) << message();
        EXPECT_STREQ(value, info.default_choice) << info.name;
        EXPECT_STREQ(info.choices[0], info.default_choice) << info.name;
        EXPECT_GE(info.choice_count, 2u) << info.name;
        for (size_t k = 0; k < info.choice_count; ++k) {
            EXPECT_EQ(rb_set_bake_string(bake, info.name, info.choices[k]), RB_ERROR_NONE)
                << message();
            EXPECT_EQ(rb_get_bake_string(bake, info.name, &value), RB_ERROR_NONE) << message();
            EXPECT_STREQ(value, info.choices[k]);
            EXPECT_GT(std::strlen(info.choice_help[k]), 10u) << info.choices[k];
        }
    }
}

TEST_F(ApiSettings, TheChoiceThatASettingIsUsedWithExistsAndHasOtherValuesToo) {
    const std::vector<rb_setting_info> all = allSettings();
    size_t limited = 0;
    for (const rb_setting_info& info : all) {
        if (!info.used_with) {
            EXPECT_EQ(info.used_with_choices, 0u) << info.name;
            continue;
        }
        ++limited;
        const auto choice = std::find_if(all.begin(), all.end(), [&](const rb_setting_info& other) {
            return std::strcmp(other.name, info.used_with) == 0;
        });
        ASSERT_NE(choice, all.end()) << info.name;
        EXPECT_EQ(choice->type, RB_SETTING_CHOICE) << info.name;
        EXPECT_NE(info.used_with_choices, 0u) << info.name;
        EXPECT_LT(info.used_with_choices, (1u << choice->choice_count) - 1) << info.name;
    }
    EXPECT_GE(limited, 6u);
}

TEST_F(ApiSettings, UnknownIndicesAndSizesAreRefused) {
    rb_setting_info info{};
    info.size = sizeof info;
    expectInvalid(rb_get_setting_info(rb_get_setting_count(), &info), "index");
    expectInvalid(rb_get_setting_info(SIZE_MAX, &info), "index");
    expectInvalid(rb_get_setting_info(0, nullptr), "info");
    for (size_t size : {size_t(0), sizeof info + 1}) {
        info.size = size;
        expectInvalid(rb_get_setting_info(0, &info), "size");
    }
    EXPECT_EQ(info.name, nullptr);
}

TEST_F(ApiSettings, NoMoreIsWrittenThanTheCallerHasRoomFor) {
    rb_setting_info info{};
    info.size = offsetof(rb_setting_info, help);
    EXPECT_EQ(rb_get_setting_info(0, &info), RB_ERROR_NONE) << message();
    EXPECT_STREQ(info.name, infoOf(0).name);
    EXPECT_EQ(info.help, nullptr);
    EXPECT_EQ(info.size, offsetof(rb_setting_info, help));
}

std::string text(const rb_setting_info& info, double value) {
    char digits[32];
    std::snprintf(digits, sizeof digits, info.type == RB_SETTING_INT ? "%.0f" : "%g", value);
    return digits;
}

// Returns the cell of the table that lists type, range and unit of a number, or the names of a
// choice.
std::string valuesOf(const rb_setting_info& info) {
    if (info.type == RB_SETTING_CHOICE) {
        std::string names;
        for (size_t k = 0; k < info.choice_count; ++k)
            names += (k > 0 ? ", `" : "`") + std::string(info.choices[k]) + "`";
        return names;
    }
    const bool isInt = info.type == RB_SETTING_INT;
    if (isInt && info.least == 0 && info.most == 1) return "int, 0 or 1";
    return (isInt ? "int, " : "float, ") + text(info, info.least) + " to " + text(info, info.most) +
           (*info.unit ? " " : "") + info.unit;
}

TEST_F(ApiSettings, TableInTheDocsIsThatOfTheLibrary) {
    std::string table = "| setting | values | default | what it does |\n|---|---|---|---|\n";
    for (const rb_setting_info& info : allSettings())
        table += std::string("| `") + info.name + "` | " + valuesOf(info) + " | " +
                 (info.type == RB_SETTING_CHOICE ? "`" + std::string(info.default_choice) + "`"
                                                 : text(info, info.default_number)) +
                 " | " + info.help + " |\n";
    expectOnPage("c_api.md", table);
}

}  // namespace
}  // namespace raybundle
