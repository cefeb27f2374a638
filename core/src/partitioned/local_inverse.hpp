// SPDX-License-Identifier: BSD-3-Clause
// H⁻¹ where no entry of H couples one process with another: exact and local.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "delassus/sdk/h_inverse.hpp"
#include "problem/structure.hpp"

namespace delassus {

/// Parts of rows of D, each within the columns of one process; columns count from its first.
struct RowParts {
    std::vector<std::int32_t> row_start = {0};
    std::vector<std::int32_t> column;
    std::vector<double> value;

    [[nodiscard]] std::size_t rows() const { return row_start.size() - 1; }
    void put(std::int64_t place, double entry) {
        column.push_back(static_cast<std::int32_t>(place));
        value.push_back(entry);
    }
    void end_row() { row_start.push_back(static_cast<std::int32_t>(value.size())); }
    void clear() {
        row_start.assign(1, 0);
        column.clear();
        value.clear();
    }
};

/// Factored own rows of H.
class LocalInverse {
public:
    /// H: own rows and columns, positive diagonal, small blocks or sparse as kind says. Both must outlive this object.
    /// Throws sdk::NumericalFailure if H is not positive definite.
    LocalInverse(const SparseMatrix& H, const BlockPartition& blocks, Structure kind);

    [[nodiscard]] double smallest_relative_pivot() const { return inverse_.smallest_relative_pivot(); }
    /// v ← H⁻¹ v, n.
    void apply(sdk::Vector& v) const { inverse_.apply(v); }
    /// squares[i] += dᵢ H⁻¹ dᵢᵀ for every part dᵢ; as many as rows.
    void add_squares(const RowParts& parts, std::span<double> squares) const;

private:
    std::int32_t n_;
    sdk::HInverse inverse_;
};

}  // namespace delassus
