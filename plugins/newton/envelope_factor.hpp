// SPDX-License-Identifier: BSD-3-Clause
// L Lᵀ of a symmetric positive definite matrix within its envelope: of each row, all from the first entry on.
#pragma once

#include <cstdint>
#include <vector>

#include "delassus/sdk/problem_view.hpp"

namespace delassus::newton {

/// For small matrices and for those whose order is already a good one: no analysis, no indices in the inner loops.
/// (Jennings 1966; George and Liu 1981, chapter 4.)
class EnvelopeFactor {
public:
    /// first: of each row, its first column, at most the row itself.
    void analyze(std::vector<std::int32_t> first);

    /// Multiplications of a factorisation in such an envelope, about.
    [[nodiscard]] static double work(const std::vector<std::int32_t>& first);

    /// Entry j of the returned pointer is that of column j; first ≤ j ≤ row.
    [[nodiscard]] double* row(std::int32_t row) { return value_.data() + offset_[static_cast<std::size_t>(row)]; }
    [[nodiscard]] std::vector<double>& values() { return value_; }

    /// values() ← L. False if a pivot is not positive.
    [[nodiscard]] bool factorize();
    /// v ← A⁻¹ v.
    void solve(sdk::Vector& v) const;

private:
    [[nodiscard]] const double* row(std::int32_t row) const {
        return value_.data() + offset_[static_cast<std::size_t>(row)];
    }

    std::vector<std::int32_t> first_;
    std::vector<std::ptrdiff_t> offset_;  // of column 0, which need not exist
    std::vector<double> value_;
};

}  // namespace delassus::newton
