// SPDX-License-Identifier: BSD-3-Clause
// The data behind `auto`: which solvers take a problem, in which order (plugins/ranking.json, docs/solvers/auto.md).
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "delassus/needs.hpp"
#include "solver/stages.hpp"

namespace delassus {

/// A stage of the ranking: a solver and what it is to do.
struct RankedStage {
    std::string solver;
    OptionTexts options;
    Stage stage;
};

/// Stages for the problems that it matches.
struct RankingRule {
    std::string name;
    bool any_cones = true, linear = false;  ///< linear: free rows only
    std::vector<Law> laws;                  ///< none: any
    std::vector<Structure> structures;      ///< none: any
    std::int32_t smallest_m = 0, largest_m = std::numeric_limits<std::int32_t>::max();
    double smallest_tolerance = 0.0, largest_tolerance = std::numeric_limits<double>::infinity();
    std::vector<RankedStage> stages;

    [[nodiscard]] bool matches(const PreparedProblem& problem, double tolerance) const;
};

class Ranking {
public:
    /// Reads a file. Throws InputError with the file and what is wrong in it.
    explicit Ranking(const std::filesystem::path& file);

    /// The first rule that matches. The last rule of a ranking matches everything (checked when it is read).
    [[nodiscard]] const RankingRule& rule(const PreparedProblem& problem, double tolerance) const;

private:
    std::vector<RankingRule> rules_;
};

}  // namespace delassus
