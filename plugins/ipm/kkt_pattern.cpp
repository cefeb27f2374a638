// SPDX-License-Identifier: BSD-3-Clause
// The symbolic part of the linear system: blocks, form, pattern, and where each value goes.
#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "kkt_system.hpp"

namespace delassus::ipm {

namespace {

std::size_t place_of(const sdk::SparseColumns& matrix, std::int32_t row, std::int32_t column) {
    const auto* begin = matrix.innerIndexPtr() + matrix.outerIndexPtr()[column];
    const auto* end = matrix.innerIndexPtr() + matrix.outerIndexPtr()[column + 1];
    return static_cast<std::size_t>(std::lower_bound(begin, end, row) - matrix.innerIndexPtr());
}

}  // namespace

void KktSystem::analyze(const sdk::ProblemView& problem) {
    n_ = problem.n;
    m_ = problem.m;
    find_blocks(problem);
    form_ = n_ == 0 ? Form::Reduced : couples_groups_ ? Form::Augmented : settings_.form;
    std::optional<sdk::SparseFactor> tried;
    if (form_ == Form::Automatic) {
        form_ = Form::Normal;
        matrix_ = pattern(problem, Form::Normal);
        const double stored = static_cast<double>(problem.H.nonZeros() + problem.D.nonZeros() + n_ + m_);
        if (static_cast<double>(matrix_.nonZeros()) > 8.0 * stored) {
            sdk::SparseColumns augmented = pattern(problem, Form::Augmented);
            sdk::SparseFactor by_augmented;
            tried.emplace().analyze(matrix_, n_);
            by_augmented.analyze(augmented, n_);
            if (by_augmented.entries() < tried->entries()) {
                form_ = Form::Augmented;
                matrix_ = std::move(augmented);
                tried = std::move(by_augmented);
            }
        }
    } else {
        matrix_ = pattern(problem, form_);
    }
    find_places(problem);
    const Eigen::Index positive = form_ == Form::Augmented ? n_ : matrix_.rows();
    if (factor_.has_analyzed(matrix_, positive)) return;
    if (tried) {
        factor_ = std::move(*tried);
    } else {
        factor_.analyze(matrix_, positive);
    }
    ++analyses_;
}

void KktSystem::find_blocks(const sdk::ProblemView& problem) {
    groups_ = groups_of(problem);
    group_of_row_.resize(static_cast<std::size_t>(m_));
    d_blocks_.clear();
    column_.clear();
    d_slot_.clear();
    std::size_t values = 0;
    std::vector<std::int32_t> position(static_cast<std::size_t>(n_));
    for (std::size_t g = 0; g < groups_.size(); ++g) {
        const Group& group = groups_[g];
        const std::size_t begin = column_.size();
        for (std::int32_t i = 0; i < group.rows; ++i) {
            group_of_row_[static_cast<std::size_t>(group.first + i)] = static_cast<std::int32_t>(g);
            for (sdk::SparseRowsView::InnerIterator entry(problem.D, group.first + i); entry; ++entry)
                column_.push_back(static_cast<std::int32_t>(entry.col()));
        }
        const auto first = column_.begin() + static_cast<std::ptrdiff_t>(begin);
        std::sort(first, column_.end());
        column_.erase(std::unique(first, column_.end()), column_.end());
        const auto columns = static_cast<std::int32_t>(column_.size() - begin);
        for (std::int32_t k = 0; k < columns; ++k)
            position[static_cast<std::size_t>(column_[begin + static_cast<std::size_t>(k)])] = k;
        for (std::int32_t i = 0; i < group.rows; ++i)
            for (sdk::SparseRowsView::InnerIterator entry(problem.D, group.first + i); entry; ++entry)
                d_slot_.push_back(values + static_cast<std::size_t>(
                                               position[static_cast<std::size_t>(entry.col())] * group.rows + i));
        d_blocks_.push_back({columns, begin, values, 0});
        values += static_cast<std::size_t>(columns) * static_cast<std::size_t>(group.rows);
    }
    d_value_.assign(values, 0.0);
    d_rotated_.assign(values, 0.0);

    std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> index;
    e_blocks_.clear();
    values = 0;
    const auto add = [&](std::int32_t row, std::int32_t column) {
        const auto [found, is_new] = index.try_emplace({row, column}, e_blocks_.size());
        if (!is_new) return;
        e_blocks_.push_back({row, column, values, 0});
        values += static_cast<std::size_t>(groups_[static_cast<std::size_t>(row)].rows *
                                           groups_[static_cast<std::size_t>(column)].rows);
    };
    for (std::size_t g = 0; g < groups_.size(); ++g) add(static_cast<std::int32_t>(g), static_cast<std::int32_t>(g));
    e_slot_.clear();
    for (std::int32_t i = 0; i < m_; ++i) {
        const std::int32_t row = group_of_row_[static_cast<std::size_t>(i)];
        for (sdk::SparseRowsView::InnerIterator entry(problem.E, i); entry; ++entry) {
            const std::int32_t column = group_of_row_[static_cast<std::size_t>(entry.col())];
            if (column > row) {
                e_slot_.push_back(-1);
                continue;
            }
            add(row, column);
            const EBlock& block = e_blocks_[index.at({row, column})];
            const Group &down = groups_[static_cast<std::size_t>(row)],
                        &across = groups_[static_cast<std::size_t>(column)];
            e_slot_.push_back(static_cast<std::ptrdiff_t>(block.value) + (entry.col() - across.first) * down.rows +
                              (i - down.first));
        }
    }
    couples_groups_ = e_blocks_.size() > groups_.size();
    e_value_.assign(values, 0.0);
    e_rotated_.assign(values, 0.0);
}

// The lower triangle with ones for values.
sdk::SparseColumns KktSystem::pattern(const sdk::ProblemView& problem, Form form) const {
    const Eigen::Index size = n_ + (form == Form::Normal ? 0 : m_);
    std::vector<std::vector<std::int32_t>> rows(static_cast<std::size_t>(size));
    const auto add = [&rows](std::int32_t i, std::int32_t j) {
        if (i >= j) rows[static_cast<std::size_t>(j)].push_back(i);
    };
    for (std::int32_t i = 0; i < n_; ++i) {
        add(i, i);
        for (sdk::SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry)
            add(i, static_cast<std::int32_t>(entry.col()));
    }
    const auto n = static_cast<std::int32_t>(n_);
    for (std::size_t g = 0; g < groups_.size(); ++g) {
        const DBlock& block = d_blocks_[g];
        for (std::int32_t k = 0; k < block.columns; ++k) {
            const std::int32_t column = column_[block.index + static_cast<std::size_t>(k)];
            if (form == Form::Normal) {
                for (std::int32_t l = k; l < block.columns; ++l)
                    add(column_[block.index + static_cast<std::size_t>(l)], column);
            } else {
                for (std::int32_t i = 0; i < groups_[g].rows; ++i) add(n + groups_[g].first + i, column);
            }
        }
    }
    if (form != Form::Normal) {
        for (const EBlock& block : e_blocks_) {
            const Group &down = groups_[static_cast<std::size_t>(block.row)],
                        &across = groups_[static_cast<std::size_t>(block.column)];
            for (std::int32_t j = 0; j < across.rows; ++j)
                for (std::int32_t i = 0; i < down.rows; ++i) add(n + down.first + i, n + across.first + j);
        }
    }
    sdk::SparseColumns matrix(size, size);
    std::vector<std::int32_t> counts;
    for (auto& column : rows) {
        std::sort(column.begin(), column.end());
        column.erase(std::unique(column.begin(), column.end()), column.end());
        counts.push_back(static_cast<std::int32_t>(column.size()));
    }
    matrix.reserve(counts);
    for (std::size_t j = 0; j < rows.size(); ++j)
        for (const auto i : rows[j]) matrix.insert(i, static_cast<Eigen::Index>(j)) = 1.0;
    matrix.makeCompressed();
    return matrix;
}

void KktSystem::find_places(const sdk::ProblemView& problem) {
    const auto n = static_cast<std::int32_t>(n_);
    const auto place = [&](std::int32_t i, std::int32_t j) {
        return static_cast<std::int32_t>(place_of(matrix_, std::max(i, j), std::min(i, j)));
    };
    h_place_.clear();
    for (std::int32_t j = 0; j < n; ++j)  // H is symmetric: its rows are its columns
        for (sdk::SparseRowsView::InnerIterator entry(problem.H, j); entry; ++entry)
            h_place_.push_back(entry.col() >= j ? place(static_cast<std::int32_t>(entry.col()), j) : -1);
    d_place_.clear();
    for (std::size_t g = 0; g < groups_.size(); ++g) {
        DBlock& block = d_blocks_[g];
        block.place = d_place_.size();
        for (std::int32_t k = 0; k < block.columns; ++k) {
            const std::int32_t column = column_[block.index + static_cast<std::size_t>(k)];
            if (form_ == Form::Normal) {
                for (std::int32_t l = k; l < block.columns; ++l)
                    d_place_.push_back(place(column_[block.index + static_cast<std::size_t>(l)], column));
            } else {
                for (std::int32_t i = 0; i < groups_[g].rows; ++i)
                    d_place_.push_back(place(n + groups_[g].first + i, column));
            }
        }
    }
    e_place_.clear();
    if (form_ == Form::Normal) return;
    for (EBlock& block : e_blocks_) {
        block.place = e_place_.size();
        const Group &down = groups_[static_cast<std::size_t>(block.row)],
                    &across = groups_[static_cast<std::size_t>(block.column)];
        for (std::int32_t j = 0; j < across.rows; ++j)
            for (std::int32_t i = 0; i < down.rows; ++i)
                e_place_.push_back(place(n + down.first + i, n + across.first + j));
    }
}

}  // namespace delassus::ipm
