// SPDX-License-Identifier: BSD-3-Clause
// What the tests of full disks and failing allocations share.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "process/child_process.hpp"
#include "support/places.hpp"
#include "support/run_command.hpp"

namespace delassus::tests {

namespace fs = std::filesystem;

using Environment = std::vector<std::pair<std::string, std::string>>;

/// Runs `delassus` with these words, as run_child() does: under a time limit, so that a fault that makes it hang shows.
inline ChildResult run_words(std::vector<std::string> words, Environment environment = {}) {
    ChildSettings child;
    child.program = tests::places::command;
    child.arguments = std::move(words);
    child.environment = std::move(environment);
    child.timeout = 60.0;
    return run_child(child);
}

/// The words of a line; none holds a blank.
inline std::vector<std::string> words_of(const std::string& line) {
    std::istringstream stream(line);
    return {std::istream_iterator<std::string>(stream), {}};
}

/// Every file below the folder with its content, and every folder.
inline std::map<std::string, std::string> snapshot(const fs::path& folder) {
    std::map<std::string, std::string> contents;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        const std::string name = fs::relative(entry.path(), folder).string();
        contents[name] = entry.is_directory() ? "a folder" : text_of(entry.path());
    }
    return contents;
}

inline std::string names_of(const std::map<std::string, std::string>& contents) {
    std::string names;
    for (const auto& [name, content] : contents) names += name + "\n";
    return names;
}

/// Standard error is sentences of the command, a line each, and nothing else.
inline void expect_sentences(const std::string& errors, const std::string& what) {
    EXPECT_FALSE(errors.empty()) << what;
    std::istringstream lines(errors);
    for (std::string line; std::getline(lines, line);) EXPECT_EQ(line.rfind("delassus: ", 0), 0U) << what << errors;
}

}  // namespace delassus::tests
