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

/// Both bounds are included.
struct Range {
    double smallest = 0.0, largest = std::numeric_limits<double>::infinity();

    [[nodiscard]] bool takes(double value) const { return value >= smallest && value <= largest; }
    bool operator==(const Range&) const = default;
};

/// How large a problem is.
struct RankedSize {
    double m = 0.0;
    /// m/n. From about three on reactions are far from unique, and sweeps over rows slow. 0 where n = 0.
    double rows_per_velocity = 0.0;
};

/// A solver with its options, and its iterations in the first round (rounds.hpp), > 0.
struct RankedSolver {
    std::string solver;
    OptionTexts options;
    double iterations = 0.0;
    /// The law it solves with, if it is not the problem's: then it has one turn, in which it makes a start for those
    /// after it.
    std::optional<Law> law = {};
};

/// What an order looks at, apart from the size.
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
    Range m, rows_per_velocity;
    std::vector<RankedSolver> solvers;

    /// For some size.
    [[nodiscard]] bool matches(const RankedNeeds& asked) const;
};

class Ranking {
public:
    /// Reads a file. Throws InputError with the file and what is wrong in it.
    explicit Ranking(const std::filesystem::path& file);

    /// The first order that matches. The last one of a ranking matches everything (checked when it is read).
    [[nodiscard]] const Order& order(const RankedNeeds& asked, const RankedSize& size) const;
    /// The orders that some size leads to.
    [[nodiscard]] std::vector<const Order*> orders(const RankedNeeds& asked) const;

private:
    std::vector<Order> orders_;
};

}  // namespace delassus
