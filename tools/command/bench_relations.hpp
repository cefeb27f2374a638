// SPDX-License-Identifier: BSD-3-Clause
// `delassus bench run relations`: random scenes, and what must hold between runs of them (relations/relations.hpp).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "command.hpp"

namespace delassus::command {

struct RelationsArguments {
    std::uint64_t count = 100, seed = 1, first = 0;
    double minutes = 0.0;  ///< 0: no limit
    double shrink_seconds = 30.0;
    int jobs = 1;
    std::filesystem::path scene;  ///< empty: random ones
    // Of `bench run`.
    std::filesystem::path output;
    std::vector<std::string> only;
    std::vector<std::filesystem::path> plugin_path;  ///< absolute

    std::vector<const CLI::Option*> options;  ///< those that are for relations alone
    /// The first of them that the command line has, or null.
    [[nodiscard]] const CLI::Option* given() const;
};

/// Whether the suite of `bench run` is this one, and no file.
[[nodiscard]] bool is_relations(const std::string& suite);
/// Its lines of `bench list`.
[[nodiscard]] std::string about_relations();

void add_relations_options(CLI::App& run, RelationsArguments& arguments);
/// The exit code: 0 if every relation held or was excused by the run, 3 if one was violated or the run interrupted.
int run_relations(const RelationsArguments& arguments);

}  // namespace delassus::command
