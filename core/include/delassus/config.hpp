// SPDX-License-Identifier: BSD-3-Clause
// The solver section of a configuration (docs/configuration.md):
//
//     solver:
//       name: pgs
//       tolerance: 1e-8
//       options: {omega: 1.2}
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/solver_config.hpp"

namespace delassus {

/// A whole configuration.
struct Config {
    SolverConfig solver;
    std::vector<std::filesystem::path> plugin_path;  ///< folders, absolute or relative to the file
};

/// Parses YAML. where names the text in messages, e.g. the file. Throws InputError with line, key and the nearest valid
/// key.
[[nodiscard]] DELASSUS_API Config parse_config(const std::string& yaml, std::string_view where);
[[nodiscard]] DELASSUS_API Config read_config(const std::filesystem::path& file);

}  // namespace delassus
