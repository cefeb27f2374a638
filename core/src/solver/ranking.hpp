// SPDX-License-Identifier: BSD-3-Clause
// The data behind `auto`: in which order solvers take turns, and how much they do in the first (plugins/ranking.json,
// docs/solvers/auto.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "delassus/needs.hpp"
#include "delassus/plugin_info.hpp"

namespace delassus {

/// Numbers of rows, both included.
struct RowRange {
    std::int32_t smallest = 0, largest = std::numeric_limits<std::int32_t>::max();

    [[nodiscard]] bool takes(std::int32_t m) const { return m >= smallest && m <= largest; }
    bool operator==(const RowRange&) const = default;
};

/// A solver with its options, and its iterations in the first round (rounds.hpp).
struct RankedSolver {
    std::string solver;
    OptionTexts options;
    std::int64_t iterations = 0;
    /// The law it solves with, if it is not the problem's: then it has one turn, in which it makes a start for those
    /// after it.
    std::optional<Law> law = {};
};

/// What an order looks at, apart from m.
struct RankedNeeds {
    std::uint64_t needs = 0;  ///< DELASSUS_CAN_* bits of the problem
    bool step = false;        ///< a step of a simulation
};

/// The order of solvers for the problems that it matches.
struct Order {
    std::string name;
    std::optional<bool> linear;       ///< free rows only, or others too
    std::optional<bool> step;         ///< a step of a simulation, or a problem by itself
    std::optional<bool> partitioned;  ///< a distributed problem, or one that every process has as a whole
    std::optional<Law> law;           ///< of problems with friction
    RowRange m;
    std::vector<RankedSolver> solvers;

    /// For some m.
    [[nodiscard]] bool matches(const RankedNeeds& asked) const;
};

class Ranking {
public:
    /// Reads a file. Throws InputError with the file and what is wrong in it.
    explicit Ranking(const std::filesystem::path& file);

    /// The first order that matches. The last one of a ranking matches everything (checked when it is read).
    [[nodiscard]] const Order& order(const RankedNeeds& asked, std::int32_t m) const;
    /// The orders that some m leads to.
    [[nodiscard]] std::vector<const Order*> orders(const RankedNeeds& asked) const;

private:
    std::vector<Order> orders_;
};

}  // namespace delassus
