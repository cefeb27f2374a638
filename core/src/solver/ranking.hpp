// SPDX-License-Identifier: BSD-3-Clause
// The data behind `auto`: which solvers take a problem, in which order (plugins/ranking.json, docs/solvers/auto.md).
#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "delassus/needs.hpp"
#include "solver/stages.hpp"

namespace delassus {

/// Numbers of rows, both included.
struct RowRange {
    std::int32_t smallest = 0, largest = std::numeric_limits<std::int32_t>::max();

    [[nodiscard]] bool takes(std::int32_t m) const { return m >= smallest && m <= largest; }
    bool operator==(const RowRange&) const = default;
};

/// A stage of the ranking: a solver and what it is to do.
struct RankedStage {
    std::string solver;
    OptionTexts options;
    Stage stage;
    bool last = false;  ///< no other stage follows: where this one fails, the others would too
    RowRange m = {};    ///< of the problems that the stage is for
};

/// What a rule looks at, apart from m.
struct RankedNeeds {
    std::uint64_t needs = 0;  ///< DELASSUS_CAN_* bits of the problem
    double tolerance = 0.0;
    bool simulation = false;  ///< a step of a simulation
};

/// Stages for the problems that it matches.
struct RankingRule {
    std::string name;
    std::optional<bool> linear;         ///< free rows only, or others too
    std::optional<bool> simulation;     ///< a step of a simulation, or a problem by itself
    std::optional<bool> partitioned;    ///< a problem in parts, or one that every process has as a whole
    std::optional<Law> law;             ///< of problems with friction
    std::vector<Structure> structures;  ///< none: any
    RowRange m;
    double smallest_tolerance = 0.0, largest_tolerance = std::numeric_limits<double>::infinity();
    std::vector<RankedStage> stages;

    /// For some m.
    [[nodiscard]] bool matches(const RankedNeeds& asked) const;
};

class Ranking {
public:
    /// Reads a file. Throws InputError with the file and what is wrong in it.
    explicit Ranking(const std::filesystem::path& file);

    /// The first rule that matches. The last rule of a ranking matches everything (checked when it is read).
    [[nodiscard]] const RankingRule& rule(const RankedNeeds& asked, std::int32_t m) const;
    /// The rules that some m leads to.
    [[nodiscard]] std::vector<const RankingRule*> rules(const RankedNeeds& asked) const;

private:
    std::vector<RankingRule> rules_;
};

}  // namespace delassus
