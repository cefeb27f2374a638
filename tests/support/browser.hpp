// SPDX-License-Identifier: BSD-3-Clause
// Pages that Delassus writes, opened as a reader would.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <string>
#include <vector>

#include "process/child_process.hpp"
#include "support/places.hpp"

namespace delassus::tests {

inline bool has_browser() {
    return !std::string(tests::places::chromium).empty();
}

struct Browsed {
    bool timed_out = false;
    std::string dom;  ///< the page's elements, as its scripts left them
    std::string log;
};

/// Opens the page in a headless Chromium without a network, lets its clock run for five seconds, and looks at what it
/// has become. profile: a folder that the browser may make. flags: more of its own.
inline Browsed open_in_browser(const std::filesystem::path& page, const std::filesystem::path& profile,
                               const std::vector<std::string>& flags = {}) {
    ChildSettings child;
    child.program = tests::places::chromium;
    child.arguments = {"--headless",
                       "--no-sandbox",
                       "--disable-quic",
                       "--no-first-run",
                       "--disable-background-networking",
                       "--disable-component-update",
                       "--disable-sync",
                       "--user-data-dir=" + profile.string(),
                       "--virtual-time-budget=5000"};
    child.arguments.insert(child.arguments.end(), flags.begin(), flags.end());
    child.arguments.insert(child.arguments.end(), {"--dump-dom", "file://" + page.string()});
    child.timeout = 120.0;
    const auto run = run_child(child);
    return {run.timed_out, run.output, run.errors};
}

/// own: the page without the libraries in it, whose texts hold addresses.
inline void expect_nothing_from_elsewhere(const std::string& own) {
    EXPECT_FALSE(std::regex_search(own, std::regex("(src|href)\\s*=\\s*[\"']?(https?:)?//")));
    for (const char* word : {"@import", "url(", "import(", "fetch(", "XMLHttpRequest", "<link", "<iframe"})
        EXPECT_EQ(own.find(word), std::string::npos) << word;
    EXPECT_NE(own.find("default-src 'none'"), std::string::npos);  // the browser itself refuses the rest
}

}  // namespace delassus::tests
