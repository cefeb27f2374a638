// SPDX-License-Identifier: BSD-3-Clause
#include "problem/mobility.hpp"

namespace delassus {

using sdk::Vector;

void Mobility::factorize(const sdk::ProblemView& problem) {
    inverse_.factorize(problem);
    diagonal_is_known_ = false;
    if (inverse_.kind() == sdk::HInverse::Kind::Diagonal) {
        inverse_diagonal_.setOnes(problem.n);
        inverse_.apply(inverse_diagonal_);
    }
}

const Vector& Mobility::free_velocity(const sdk::ProblemView& problem, Vector& r) {
    r = problem.b;
    if (problem.n > 0) velocity(problem, nullptr, work_);
    if (diagonal_is_known_ || inverse_.kind() != sdk::HInverse::Kind::Diagonal || problem.E.nonZeros() > 0) {
        if (!diagonal_is_known_) find_diagonal(problem);
        if (problem.n > 0) r.noalias() += problem.D * work_;
    } else {
        // Both in one pass over D.
        diagonal_.resize(problem.m);
        for (Eigen::Index row = 0; row < problem.m; ++row) {
            double velocity = 0.0, square = 0.0;
            for (sdk::SparseRowsView::InnerIterator entry(problem.D, row); entry; ++entry) {
                velocity += entry.value() * work_[entry.col()];
                square += entry.value() * entry.value() * inverse_diagonal_[entry.col()];
            }
            r[row] += velocity;
            diagonal_[row] = square;
        }
    }
    diagonal_is_known_ = true;
    return diagonal_;
}

void Mobility::find_diagonal(const sdk::ProblemView& problem) {
    diagonal_.setZero(problem.m);
    if (problem.n > 0)
        inverse_.for_each_half_solved_row(
            problem.D, [&](Eigen::Index row, const std::vector<std::int32_t>& reach, const Vector& work) {
                for (const auto i : reach) diagonal_[row] += work[i] * work[i];
            });
    if (problem.E.nonZeros() == 0) return;
    for (Eigen::Index row = 0; row < problem.m; ++row)
        for (sdk::SparseRowsView::InnerIterator entry(problem.E, row); entry; ++entry)
            if (entry.col() == row) diagonal_[row] += entry.value();
}

void Mobility::velocity(const sdk::ProblemView& problem, const double* lambda, Vector& x) const {
    x = problem.a;
    if (problem.n == 0) return;
    if (lambda) x.noalias() += problem.D.transpose() * sdk::VectorView(lambda, problem.m);
    inverse_.apply(x);
}

}  // namespace delassus
