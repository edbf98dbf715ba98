// SPDX-License-Identifier: GPL-3.0-or-later
//
// Tables of the pages in docs/ that the library itself can make, so that they cannot go stale.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>

namespace raybundle::test {

// Expects that a page in docs/ has a table, line by line; if not, prints what is to be put there.
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
