// SPDX-License-Identifier: BSD-3-Clause
// An axis of a suite: one problem or scene, made harder value by value, with bounds that a correct answer keeps.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "bench/measurement.hpp"
#include "bench/scene_measurement.hpp"
#include "config/yaml_reader.hpp"
#include "delassus/registry.hpp"

namespace delassus::bench {

/// What a figure of a run must not exceed.
struct Bound {
    std::string measure;
    double limit = 0.0;
};

struct SuiteAxis {
    std::string name;            ///< for --only
    std::string title;           ///< what varies, for tables; the name if none is given
    std::string unit;            ///< of the values; may be empty
    std::string reason;          ///< why the bounds are right
    std::vector<double> values;  ///< from where all is easy to where it is not

    // By value, one of the two lists; the other is empty.
    std::vector<ProblemSource> problems;
    std::vector<SceneSource> scenes;
    std::vector<std::vector<Bound>> bounds;  ///< by value

    // Of problems. Solvers: in place of the suite's; may be empty.
    std::vector<SolverConfig> solvers;
    std::string law;  ///< empty: the problem's own
    double tolerance = 1e-8;

    // Of scenes; texts as of SimulateRequest.
    std::vector<std::string> timesteppers = {""}, step_solvers = {""};
    std::string body;                              ///< whose place at the end is known; empty: none
    std::vector<std::array<double, 3>> positions;  ///< by value, m; empty without a body

    double time_limit = 0.0;  ///< s; 0: the suite's
};

/// One measure of the table of what can be bounded.
struct Measure {
    std::string name;
    std::string unit;  ///< empty: dimensionless
    bool of_problems, of_scenes;
};
[[nodiscard]] const std::vector<Measure>& measures();

/// Adds an item of "axes". Throws InputError with place and key.
[[nodiscard]] SuiteAxis read_axis(const Source& source, const YAML::Node& item, const Registry& registry,
                                  std::vector<std::string>& left_out);

}  // namespace delassus::bench
