// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "delassus/error.hpp"
#include "delassus/problem.hpp"

namespace delassus::generating {

/// Writes a SparseMatrix row by row, in linear time: put() with ascending columns, then end_row().
class Rows {
public:
    /// Exact zeros are left out.
    void put(std::int32_t column, double value) {
        if (value == 0.0) return;
        matrix_.column.push_back(column);
        matrix_.value.push_back(value);
    }

    void end_row() {
        if (matrix_.value.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
            throw InputError("the problem would have more than 2147483647 matrix entries; choose a smaller one");
        }
        matrix_.row_start.push_back(matrix_.entries());
        ++matrix_.rows;
    }

    [[nodiscard]] std::int32_t count() const { return matrix_.rows; }

    SparseMatrix finish(std::int32_t columns) {
        matrix_.columns = columns;
        return std::move(matrix_);
    }

private:
    SparseMatrix matrix_;
};

}  // namespace delassus::generating
