// SPDX-License-Identifier: BSD-3-Clause
// Parts of a step's problem that have nothing to do with one another.
#pragma once

#include <cstdint>
#include <vector>

#include "delassus/problem.hpp"

namespace delassus {

/// A part: columns that H and rows of D connect, and the cones of those rows. Both ascend.
struct Island {
    std::vector<std::int32_t> columns;
    std::vector<std::int32_t> cones;  ///< indices into Problem::cones; empty: nothing touches these columns
};

/// The parts of a problem without E, by their first columns; those without cones are gathered in one part at the end,
/// if there are any. Cones whose rows have no entries (between fixed bodies) belong to none: nothing that a solver does
/// changes them. Refers to the problem. Linear in its entries, all parts together.
class Islands {
public:
    explicit Islands(const Problem& problem);

    [[nodiscard]] const std::vector<Island>& list() const { return islands_; }
    /// The problem of one part.
    [[nodiscard]] Problem part(const Island& island) const;
    /// The entries of the whole that belong to a part, and back.
    [[nodiscard]] Solution take(const Island& island, const Solution& whole) const;
    void put(const Island& island, const Solution& part, Solution& whole) const;

private:
    const Problem& problem_;
    std::vector<std::int32_t> first_row_;  // of each cone, and the end
    std::vector<std::int32_t> place_;      // of each column in its part
    std::vector<Island> islands_;
};

}  // namespace delassus
