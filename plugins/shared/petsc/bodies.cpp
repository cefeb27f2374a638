// SPDX-License-Identifier: BSD-3-Clause
#include "bodies.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace delassus::petsc {

namespace {

std::size_t at(std::int64_t i) {
    return static_cast<std::size_t>(i);
}

/// H of the local bodies as HInverse takes it.
delassus_problem problem_of(const sdk::LocalProblemView& problem, Eigen::Index n, const delassus_matrix& H,
                            const std::vector<std::int32_t>& block_start,
                            const std::vector<std::int32_t>& block_index) {
    delassus_problem whole{};
    whole.struct_size = sizeof whole;
    whole.n = static_cast<std::int32_t>(n);
    whole.H = H;
    whole.cone_stride = sizeof(delassus_cone);
    whole.h_block_count = static_cast<std::int32_t>(block_start.size()) - 1;
    whole.h_block_start = block_start.data();
    whole.h_block_index = block_index.data();
    whole.needs = problem.needs & (DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS);
    return whole;
}

}  // namespace

void Bodies::analyze(const Processes& processes, const sdk::LocalProblemView& problem) {
    processes_ = processes;
    columns_ = Exchange(processes, problem.column_start,
                        foreign_columns(problem.D, problem.first_column(), problem.first_column() + problem.n));
    diagonal_ = problem.needs_any(DELASSUS_CAN_H_DIAGONAL);
    has_blocks_ = diagonal_ || problem.needs_any(DELASSUS_CAN_H_BLOCKS);
    inverse_ = {};
    block_start_.assign(1, 0);
    block_index_.clear();
    if (has_blocks_) find_blocks(problem);
}

// Each column tells its block's columns; blocks of others are then completed where D touches them in part.
void Bodies::find_blocks(const sdk::LocalProblemView& problem) {
    if (diagonal_) {
        block_start_.resize(at(columns_.size()) + 1);
        block_index_.resize(at(columns_.size()));
        std::iota(block_start_.begin(), block_start_.end(), 0);
        std::iota(block_index_.begin(), block_index_.end(), 0);
    } else {
        const auto count = problem.h_block_start.size() > 0 ? problem.h_block_start.size() - 1 : 0;
        std::int64_t largest = 1;
        for (std::size_t k = 0; k < count; ++k)
            largest = std::max(largest, problem.h_block_start[k + 1] - problem.h_block_start[k]);
        width_ = static_cast<int>(processes_.max(largest));
        const auto width = at(width_);
        std::vector<std::int64_t> members;  // width a local column; its block's numbers, ascending, then −1
        const auto tell = [&] {
            members.assign(width * at(columns_.size()), -1);
            std::vector<std::int64_t> block;
            for (std::size_t k = 0; k < count; ++k) {
                block.clear();
                for (auto i = at(problem.h_block_start[k]); i < at(problem.h_block_start[k + 1]); ++i)
                    block.push_back(problem.first_column() + problem.h_block_index[i]);
                std::sort(block.begin(), block.end());
                for (const auto number : block)
                    std::copy(block.begin(), block.end(),
                              members.begin() + static_cast<std::ptrdiff_t>(width * at(columns_.local(number))));
            }
            columns_.bring(members.data(), width_);
        };
        const auto is_foreign = [&](std::int64_t number) {
            return number >= 0 && (number < problem.first_column() || number >= problem.first_column() + problem.n);
        };
        tell();
        std::vector<std::int64_t> whole;
        for (const auto number : members)
            if (is_foreign(number)) whole.push_back(number);
        std::sort(whole.begin(), whole.end());
        whole.erase(std::unique(whole.begin(), whole.end()), whole.end());
        if (processes_.any(whole.size() != columns_.foreign().size())) {
            columns_ = Exchange(processes_, problem.column_start, std::move(whole));
            tell();
        }
        for (Eigen::Index i = 0; i < columns_.size(); ++i) {
            const auto* block = members.data() + width * at(i);
            if (block[0] != columns_.number(i)) continue;
            for (std::size_t k = 0; k < width && block[k] >= 0; ++k) block_index_.push_back(columns_.local(block[k]));
            block_start_.push_back(static_cast<std::int32_t>(block_index_.size()));
        }
    }
    const std::vector<std::int32_t> none(at(columns_.size()) + 1, 0);
    const auto n = static_cast<std::int32_t>(columns_.size());
    const auto whole = problem_of(problem, n, {n, n, 0, none.data(), nullptr, nullptr}, block_start_, block_index_);
    inverse_.analyze(sdk::ProblemView(whole));
}

void Bodies::factorize(const sdk::LocalProblemView& problem) {
    if (!has_blocks_) return;
    const sdk::CompressedRows H = fetched(problem);
    const auto n = static_cast<std::int32_t>(columns_.size());
    const auto whole = problem_of(problem, n, {n, n, H.start.back(), H.start.data(), H.column.data(), H.value.data()},
                                  block_start_, block_index_);
    processes_.together([&] { inverse_.factorize(sdk::ProblemView(whole)); });
}

sdk::CompressedRows Bodies::fetched(const sdk::LocalProblemView& problem) const {
    const auto width = diagonal_ ? std::size_t{1} : at(width_);
    std::vector<double> values(width * at(columns_.size()), 0.0);  // rows of H over their blocks
    std::vector<std::int32_t> block_of(at(columns_.size()));
    for (std::size_t k = 0; k + 1 < block_start_.size(); ++k)
        for (auto i = block_start_[k]; i < block_start_[k + 1]; ++i)
            block_of[at(block_index_[at(i)])] = static_cast<std::int32_t>(k);
    for (Eigen::Index i = 0; i < problem.n; ++i) {
        const auto row = at(columns_.first_own() + i);
        const auto* first = block_index_.data() + block_start_[at(block_of[row])];
        const auto* last = block_index_.data() + block_start_[at(block_of[row]) + 1];
        for (auto e = at(problem.H.row_start[at(i)]); e < at(problem.H.row_start[at(i) + 1]); ++e) {
            const auto* place = std::lower_bound(first, last, columns_.local(problem.H.column[e]));
            values[width * row + at(place - first)] = problem.H.value[e];
        }
    }
    columns_.bring(values.data(), static_cast<int>(width));
    sdk::CompressedRows H;
    H.clear();
    H.start.reserve(block_of.size() + 1);
    H.column.reserve(values.size());
    H.value.reserve(values.size());
    for (std::size_t row = 0; row < block_of.size(); ++row) {
        const auto block = at(block_of[row]);
        for (auto i = block_start_[block]; i < block_start_[block + 1]; ++i)
            H.put(block_index_[at(i)], values[width * row + at(i - block_start_[block])]);
        H.end_row();
    }
    return H;
}

void Bodies::multiply_add(const sdk::LocalProblemView& problem, const sdk::Vector& v, sdk::Vector& result) const {
    for (Eigen::Index row = 0; row < problem.m; ++row) {
        double sum = 0.0;
        for (auto e = at(problem.D.row_start[at(row)]); e < at(problem.D.row_start[at(row) + 1]); ++e)
            sum += problem.D.value[e] * v[columns_.local(problem.D.column[e])];
        result[row] += sum;
    }
}

void fill_immobile(const Processes& processes, const sdk::ConeRange& cones, sdk::Vector& diagonal) {
    const auto rows_of = [&](const delassus_cone& cone) { return diagonal.segment(cone.first_row, cone.rows); };
    std::array<double, 2> sums = {};
    for (const delassus_cone& cone : cones)
        if (const double trace = rows_of(cone).sum() / cone.rows; trace > 0.0) {
            sums[0] += trace;
            sums[1] += 1.0;
        }
    processes.sum(sums);
    const double mean = sums[1] > 0.0 ? sums[0] / sums[1] : 1.0;
    for (const delassus_cone& cone : cones)
        if (!(rows_of(cone).sum() > 0.0)) rows_of(cone).setConstant(mean);
}

sdk::SparseRowsView LocalRows::view(const sdk::LocalMatrixView& matrix, const Exchange& columns, Eigen::Index first,
                                    Eigen::Index last) {
    const auto begin = matrix.row_start[at(first)], end = matrix.row_start[at(last)];
    if (end - begin >= std::numeric_limits<std::int32_t>::max())
        throw std::runtime_error("one process has too many entries of a matrix for 32-bit numbers: use more processes");
    start_.resize(at(last - first) + 1);
    column_.resize(at(end - begin));
    for (Eigen::Index i = first; i <= last; ++i)
        start_[at(i - first)] = static_cast<std::int32_t>(matrix.row_start[at(i)] - begin);
    for (auto e = begin; e < end; ++e) column_[at(e - begin)] = columns.local(matrix.column[at(e)]);
    return {last - first, columns.size(), end - begin, start_.data(), column_.data(), matrix.value.data() + begin};
}

}  // namespace delassus::petsc
