// SPDX-License-Identifier: BSD-3-Clause
#include "problem/mobility.hpp"

#include <utility>

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

void Mobility::factorize(const sdk::ProblemView& problem) {
    rows_are_new_ = H_is_diagonal_;
    if (!H_is_diagonal_) return operator_.factorize(problem);
    inverse_.factorize(problem);
    inverse_diagonal_.setOnes(problem.n);
    inverse_.apply(inverse_diagonal_);
}

const Vector& Mobility::free_velocity(const sdk::ProblemView& problem, Vector& r) {
    const bool new_rows = std::exchange(rows_are_new_, false);
    if (!H_is_diagonal_) {
        if (new_rows) operator_.refresh(problem);
        operator_.free_velocity(problem, r);
        return operator_.diagonal();
    }
    r = problem.b;
    velocity(problem, nullptr, work_);
    if (!new_rows) {
        r.noalias() += problem.D * work_;
        return diagonal_;
    }
    // Both in one pass over D.
    diagonal_.resize(problem.m);
    for (Eigen::Index row = 0; row < problem.m; ++row) {
        double velocity = 0.0, square = 0.0;
        for (sdk::SparseRowsView::InnerIterator entry(problem.D, row); entry; ++entry) {
            velocity += entry.value() * work_[entry.col()];
            square += entry.value() * entry.value() * inverse_diagonal_[entry.col()];
        }
        for (sdk::SparseRowsView::InnerIterator entry(problem.E, row); entry; ++entry)
            if (entry.col() == row) square += entry.value();
        r[row] += velocity;
        diagonal_[row] = square;
    }
    return diagonal_;
}

void Mobility::velocity(const sdk::ProblemView& problem, const double* lambda, Vector& x) const {
    x = problem.a;
    if (problem.n == 0) return;
    if (lambda) x.noalias() += problem.D.transpose() * sdk::VectorView(lambda, problem.m);
    inverse().apply(x);
}

}  // namespace delassus
