// SPDX-License-Identifier: BSD-3-Clause
#include "problem/mobility.hpp"

#include <utility>

#include "problem/dense_rows.hpp"

namespace delassus {

using sdk::Vector;

void Mobility::analyze(const sdk::ProblemView& problem) {
    H_is_diagonal_ = problem.n > 0 && problem.needs_any(DELASSUS_CAN_H_DIAGONAL);
    if (H_is_diagonal_) {
        inverse_.analyze(problem);
    } else {
        operator_.analyze(problem);
    }
}

void Mobility::factorize(const sdk::ProblemView& problem, const sdk::Team& team) {
    rows_are_new_ = H_is_diagonal_;
    if (!H_is_diagonal_) return operator_.factorize(problem, false, team);
    inverse_.factorize(problem);
    inverse_diagonal_.setOnes(problem.n);
    inverse_.apply(inverse_diagonal_);
}

namespace {

/// D v and diag(D W Dᵀ) of a cone's rows, which have their entries in the same columns; W: diagonal.
struct FreeRows {
    const Vector &v, &W;
    double *velocity, *square;  ///< of the first row

    template <int length>
    void operator()(const DenseRows<length>& rows) const {
        const auto v_of_columns = rows.gather(v), W_of_columns = rows.gather(W);
        for (std::int32_t i = 0; i < rows.count; ++i) {
            const auto row = rows.row(i);
            velocity[i] = (row * v_of_columns).sum();
            square[i] = (row.square() * W_of_columns).sum();
        }
    }
};

}  // namespace

const Vector& Mobility::free_velocity(const sdk::ProblemView& problem, std::span<const char> shares_columns,
                                      const sdk::Team& team, Vector& r) {
    const bool new_rows = std::exchange(rows_are_new_, false);
    if (!H_is_diagonal_) {
        if (new_rows) operator_.refresh(problem, team);
        operator_.free_velocity(problem, r);
        return operator_.diagonal();
    }
    velocity(problem, nullptr, work_);
    if (!new_rows) {
        r = problem.b;
        r.noalias() += problem.D * work_;
        return diagonal_;
    }
    // Both in one pass over D.
    r.resize(problem.m);
    diagonal_.resize(problem.m);
    const delassus_matrix& D = problem.raw->D;
    const auto visit = [&](std::size_t c) {
        const delassus_cone& cone = problem.cones[c];
        const auto first = cone.first_row, last = first + cone.rows;
        prefetch_after(D, first);
        if (!shares_columns[c] ||
            !for_dense_rows(D, cone, FreeRows{work_, inverse_diagonal_, r.data() + first, diagonal_.data() + first}))
            for (auto row = first; row < last; ++row) {
                double velocity = 0.0, square = 0.0;
                for (auto k = D.row_start[row]; k < D.row_start[row + 1]; ++k) {
                    velocity += D.value[k] * work_[D.column[k]];
                    square += D.value[k] * D.value[k] * inverse_diagonal_[D.column[k]];
                }
                r[row] = velocity;
                diagonal_[row] = square;
            }
        for (auto row = first; row < last; ++row) r[row] += problem.b[row];
    };
    team.run([&](int member) {
        const auto [first, last] = team.share(problem.cones.size(), member);
        for (std::size_t c = first; c < last; ++c) visit(c);
    });
    for (Eigen::Index row = 0; row < problem.m && problem.E.nonZeros() > 0; ++row)
        diagonal_[row] += problem.E.coeff(row, row);
    return diagonal_;
}

void Mobility::velocity(const sdk::ProblemView& problem, const double* lambda, Vector& x) const {
    x = problem.a;
    if (problem.n == 0) return;
    if (lambda) x.noalias() += problem.D.transpose() * sdk::VectorView(lambda, problem.m);
    inverse().apply(x);
}

}  // namespace delassus
