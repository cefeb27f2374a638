// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/matrix_assembler.hpp"

#include <fmt/format.h>

#include <numeric>

#include "delassus/error.hpp"

namespace delassus {

void MatrixAssembler::begin(std::int32_t rows, std::int32_t columns) {
    repeats_ = matrix_.rows == rows && matrix_.columns == columns;
    matrix_.rows = rows;
    matrix_.columns = columns;
    count_ = 0;
    products_.clear();
    product_columns_.clear();
    product_values_.clear();
}

void MatrixAssembler::add_matrix(const SparseMatrix& matrix, double factor) {
    for (std::int32_t row = 0; row < matrix.rows; ++row)
        for (auto e = matrix.row_start[static_cast<std::size_t>(row)];
             e < matrix.row_start[static_cast<std::size_t>(row) + 1]; ++e)
            add(row, matrix.column[static_cast<std::size_t>(e)], factor * matrix.value[static_cast<std::size_t>(e)]);
}

const SparseMatrix& MatrixAssembler::finish() {
    if (!repeats_ || count_ != slot_.size()) find_pattern();
    sum_up(matrix_.value);
    return matrix_;
}

void MatrixAssembler::finish_into(SparseMatrix& matrix) {
    if (!repeats_ || count_ != slot_.size()) find_pattern();
    matrix.rows = matrix_.rows;
    matrix.columns = matrix_.columns;
    matrix.row_start = matrix_.row_start;
    matrix.column = matrix_.column;
    sum_up(matrix.value);
}

void MatrixAssembler::sum_up(Array<double>& values) const {
    values.assign(matrix_.column.size(), 0.0);
    double* const sums = values.data();
    for (std::size_t k = 0; k < count_; ++k) sums[slot_[k]] += values_[k];
}

void MatrixAssembler::find_pattern() {
    // A stable counting sort of places by keys from 0 to keys − 1: those of one key stay in the order of `before`, or
    // in that of adding. By columns and then by rows, this takes time in proportion to the places.
    std::vector<std::size_t> start;
    const auto sort_by = [&](std::vector<std::int32_t>& sorted, const std::vector<std::int32_t>& before,
                             std::int32_t keys, const auto& key) {
        start.assign(static_cast<std::size_t>(keys) + 1, 0);
        for (std::size_t k = 0; k < count_; ++k) ++start[static_cast<std::size_t>(key(k)) + 1];
        std::partial_sum(start.begin(), start.end(), start.begin());
        sorted.resize(count_);
        for (std::size_t i = 0; i < count_; ++i) {
            const std::size_t k = before.empty() ? i : static_cast<std::size_t>(before[i]);
            sorted[start[static_cast<std::size_t>(key(k))]++] = static_cast<std::int32_t>(k);
        }
    };
    places_.resize(count_);
    values_.resize(count_);
    for (const Place& place : places_)
        if (place.row < 0 || place.row >= matrix_.rows || place.column < 0 || place.column >= matrix_.columns)
            throw InputError(fmt::format("a matrix of {} x {} was given an entry at ({}, {})", matrix_.rows,
                                         matrix_.columns, place.row, place.column));
    std::vector<std::int32_t> by_column, order;
    sort_by(by_column, {}, matrix_.columns, [&](std::size_t k) { return places_[k].column; });
    sort_by(order, by_column, matrix_.rows, [&](std::size_t k) { return places_[k].row; });
    const auto at = [&](std::int32_t k) -> const Place& { return places_[static_cast<std::size_t>(k)]; };
    slot_.resize(count_);
    matrix_.row_start.assign(static_cast<std::size_t>(matrix_.rows) + 1, 0);
    matrix_.column.clear();
    for (std::size_t k = 0; k < count_; ++k) {
        if (k == 0 || !(at(order[k]) == at(order[k - 1]))) {
            matrix_.column.push_back(at(order[k]).column);
            ++matrix_.row_start[static_cast<std::size_t>(at(order[k]).row) + 1];
        }
        slot_[static_cast<std::size_t>(order[k])] = static_cast<std::int32_t>(matrix_.column.size()) - 1;
    }
    std::partial_sum(matrix_.row_start.begin(), matrix_.row_start.end(), matrix_.row_start.begin());
    ++patterns_;
}

}  // namespace delassus
