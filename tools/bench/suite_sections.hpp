// SPDX-License-Identifier: BSD-3-Clause
// Items of a suite's lists of problems and solvers.
#pragma once

#include "bench/suite.hpp"
#include "bench/sweep.hpp"

namespace delassus::bench {

/// A path of the suite: relative to its file; "$NAME/…" begins with an environment variable, and is empty where that is
/// not set.
[[nodiscard]] std::filesystem::path suite_path(const Source& source, const std::string& text);

/// Refuses a kind, a key or a value that the generator does not take; nothing is generated.
void check_generator(const Source& source, const YAML::Node& item, const ProblemSource& problem);

/// "name(key=value)" checked against the table of methods, with the place in the message.
[[nodiscard]] std::string timestepper_text(const Source& source, const YAML::Node& node, const std::string& name,
                                           const OptionTexts& options);

/// Adds what an item of "problems" stands for.
void read_problem_item(const Source& source, const YAML::Node& item, Suite& suite);

/// Adds what an item of "solvers" stands for, each checked against its plugin's table. A solver of this project that
/// was not built is left out, and said to be.
void read_solver_item(const Source& source, const YAML::Node& item, const Registry& registry, Suite& suite);

}  // namespace delassus::bench
