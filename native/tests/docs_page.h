// SPDX-License-Identifier: GPL-3.0-or-later
//
// Compares tables in docs/ with those that the library makes, so that the pages stay up to date.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>

namespace raybundle::test {

// Expects that a page in docs/ contains a table, line by line. If not, prints the table.
inline void expectOnPage(const std::string& page, const std::string& table) {
    std::ifstream file(RAYBUNDLE_DOCS "/" + page);
    ASSERT_TRUE(file) << "docs/" << page;
    std::ostringstream text;
    text << file.rdbuf();
    EXPECT_TRUE(text.str().find(table) != std::string::npos)
        << "docs/" << page << " must have this table:\n"
        << table;
}

}  // namespace raybundle::test
