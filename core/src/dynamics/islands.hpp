// SPDX-License-Identifier: BSD-3-Clause
// Parts of a step's problem that have nothing to do with one another.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "delassus/problem.hpp"

namespace delassus {

/// A part: columns that H and rows of D connect, and the cones of those rows. Both ascend.
struct Island {
    std::vector<std::int32_t> columns;
    std::vector<std::int32_t> cones;  ///< indices into Problem::cones; empty: nothing touches these columns
};

/// The parts of a problem whose E is diagonal or absent, by their first columns; those without cones are gathered in
/// one part at the end, if there are any. Cones whose rows have no entries (between fixed bodies) belong to none:
/// nothing that a solver does changes them. Linear in its entries, all parts together. Arrays are kept from problem to
/// problem.
class Islands {
public:
    /// Finds the parts of a problem, which must outlive their use. Neighbouring columns with equal numbers in bodies,
    /// if it is not empty, are of one part.
    void find(const Problem& problem, std::span<const std::int32_t> bodies = {});

    [[nodiscard]] std::span<const Island> list() const { return {islands_.data(), count_}; }
    /// Whether a problem can be cut into parts: its E links no rows.
    [[nodiscard]] static bool can_part(const Problem& problem);
    /// Rows of a part.
    [[nodiscard]] std::int64_t rows(const Island& island) const;
    /// The problem of one part, in place of what was in part.
    void part(const Island& island, Problem& part) const;
    /// A hash of a part: its columns, its cones, and their entries in D, a and b. Neither 0 nor 1.
    [[nodiscard]] std::uint64_t identity(const Island& island) const;
    /// The entries of the whole that belong to a part, and back.
    void take(const Island& island, const Solution& whole, Solution& part) const;
    void put(const Island& island, const Solution& part, Solution& whole) const;

private:
    std::int32_t root(std::int32_t column);
    void join(std::int32_t first, std::int32_t second);
    /// Joins the columns of each cone's rows, where these are not zero.
    void join_rows(const SparseMatrix& D);
    Island& next_island();

    const Problem* problem_ = nullptr;
    std::vector<std::int32_t> first_row_;  // of each cone, and the end
    std::vector<std::int32_t> place_;      // of each column in its part
    std::vector<std::int32_t> parent_;     // disjoint sets of columns (Tarjan)
    std::vector<std::int32_t> cone_column_, number_;
    std::vector<char> touched_;
    std::vector<Island> islands_;  // of which count_ are in use
    std::size_t count_ = 0;
    Island untouched_;
};

}  // namespace delassus
