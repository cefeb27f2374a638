// SPDX-License-Identifier: BSD-3-Clause
#include "partitioned/local_inverse.hpp"

#include "problem/need_of.hpp"

namespace delassus {

LocalInverse::LocalInverse(const SparseMatrix& H, const BlockPartition& blocks, Structure kind) : n_(H.rows) {
    static const std::vector<std::int32_t> none = {0};
    delassus_problem raw{};
    raw.struct_size = sizeof raw;
    raw.n = n_;
    raw.H = {n_, n_, H.entries(), H.row_start.data(), H.column.data(), H.value.data()};
    raw.D = {0, n_, 0, none.data(), nullptr, nullptr};
    raw.E = {0, 0, 0, none.data(), nullptr, nullptr};
    raw.h_block_count = static_cast<std::int32_t>(blocks.start.size()) - 1;
    raw.h_block_start = blocks.start.data();
    raw.h_block_index = blocks.index.data();
    raw.needs = need_of(n_ > 0 ? kind : Structure::Diagonal);
    const sdk::ProblemView view(raw);
    inverse_.analyze(view);
    inverse_.factorize(view);
}

void LocalInverse::add_squares(const RowParts& parts, std::span<double> squares) const {
    const sdk::SparseRowsView D(static_cast<Eigen::Index>(parts.rows()), n_,
                                static_cast<Eigen::Index>(parts.value.size()), parts.row_start.data(),
                                parts.column.data(), parts.value.data());
    if (inverse_.kind() == sdk::HInverse::Kind::Sparse) {
        const auto& factor = inverse_.sparse();
        factor.half_solve(D, factor.reach(D), [&](Eigen::Index, std::span<const std::int32_t> rows, const auto& panel) {
            for (Eigen::Index j = 0; j < panel.cols(); ++j)
                squares[static_cast<std::size_t>(rows[static_cast<std::size_t>(j)])] += panel.col(j).squaredNorm();
        });
        return;
    }
    inverse_.for_each_half_solved_row(
        D, [&](Eigen::Index row, const std::vector<std::int32_t>& reach, const sdk::Vector& work) {
            double sum = 0.0;
            for (const auto i : reach) sum += work[i] * work[i];
            squares[static_cast<std::size_t>(row)] += sum;
        });
}

}  // namespace delassus
