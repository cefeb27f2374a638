// SPDX-License-Identifier: BSD-3-Clause
// The folder of shared problems, which a clone alone does not have.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <vector>
#include "support/places.hpp"

namespace delassus::tests {

/// $DELASSUS_SHARED_PROBLEMS, or ../shared/problems beside the source tree; it may not exist.
inline std::filesystem::path shared_problems_root() {
    const char* given = std::getenv("DELASSUS_SHARED_PROBLEMS");
    return given != nullptr ? given : tests::places::shared_problems;
}

/// All problem folders in the order of their names; empty if the folder is absent.
inline std::vector<std::filesystem::path> shared_problem_folders() {
    std::vector<std::filesystem::path> folders;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(shared_problems_root(), error)) {
        if (std::filesystem::exists(entry.path() / "problem.json")) folders.push_back(entry.path());
    }
    std::sort(folders.begin(), folders.end());
    return folders;
}

}  // namespace delassus::tests

/// Skips the test, with a message, where the shared problems are absent.
#define DELASSUS_REQUIRE_SHARED_PROBLEMS()                 \
    if (delassus::tests::shared_problem_folders().empty()) \
    GTEST_SKIP() << "no problems in " << delassus::tests::shared_problems_root() << "; set DELASSUS_SHARED_PROBLEMS"
