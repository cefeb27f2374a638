// SPDX-License-Identifier: BSD-3-Clause
// Whether an answer proves that a problem in parts has no solution: problem/infeasibility.hpp by reductions.
#pragma once

#include <vector>

#include "partitioned/prepared_part.hpp"

namespace delassus {

/// All is collective, and the same on all processes.
class PartProof {
public:
    explicit PartProof(const PreparedPart::Implementation& part);

    /// proven_size() from the own parts of an answer; x: own n, lambda: own m. The component of a least-squares answer
    /// in the range of D, which proven_size() removes by a factorisation, stays.
    [[nodiscard]] double size(const std::vector<double>& x, const std::vector<double>& lambda) const;

private:
    using Values = std::vector<double>;

    void find_units();
    [[nodiscard]] Values apply_D(const Values& x) const;
    [[nodiscard]] Values apply_E(const Values& lambda) const;
    [[nodiscard]] Values apply_H(const Values& x) const;
    [[nodiscard]] Values apply_transpose(const Values& lambda) const;
    /// units: of the direction.
    [[nodiscard]] double bound(const Values& data, const Values& direction, double squared_cost,
                               const Values& units) const;
    [[nodiscard]] double by_reactions(const Values& direction) const;
    [[nodiscard]] double by_velocities(const Values& y) const;

    const PreparedPart::Implementation& part_;
    Values R_, S_;  // of own columns and rows
    double size_ = 1.0;
};

}  // namespace delassus
