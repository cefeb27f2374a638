// SPDX-License-Identifier: BSD-3-Clause
#include "problem/mobility.hpp"

namespace delassus {

using sdk::Vector;

void Mobility::factorize(const sdk::ProblemView& problem) {
    inverse_.factorize(problem);
    if (inverse_.kind() == sdk::HInverse::Kind::Diagonal) {
        inverse_diagonal_.setOnes(problem.n);
        inverse_.apply(inverse_diagonal_);
    }
    refresh(problem);
}

void Mobility::refresh(const sdk::ProblemView& problem) {
    diagonal_.setZero(problem.m);
    if (problem.n > 0 && inverse_.kind() == sdk::HInverse::Kind::Diagonal) {
        for (Eigen::Index row = 0; row < problem.m; ++row)
            for (sdk::SparseRowsView::InnerIterator entry(problem.D, row); entry; ++entry)
                diagonal_[row] += entry.value() * entry.value() * inverse_diagonal_[entry.col()];
    } else if (problem.n > 0) {
        inverse_.for_each_half_solved_row(
            problem.D, [&](Eigen::Index row, const std::vector<std::int32_t>& reach, const Vector& work) {
                for (const auto i : reach) diagonal_[row] += work[i] * work[i];
            });
    }
    if (problem.E.nonZeros() == 0) return;
    for (Eigen::Index row = 0; row < problem.m; ++row)
        for (sdk::SparseRowsView::InnerIterator entry(problem.E, row); entry; ++entry)
            if (entry.col() == row) diagonal_[row] += entry.value();
}

void Mobility::free_velocity(const sdk::ProblemView& problem, Vector& r) const {
    r = problem.b;
    if (problem.n == 0) return;
    velocity(problem, nullptr, work_);
    r.noalias() += problem.D * work_;
}

void Mobility::velocity(const sdk::ProblemView& problem, const double* lambda, Vector& x) const {
    x = problem.a;
    if (problem.n == 0) return;
    if (lambda) x.noalias() += problem.D.transpose() * sdk::VectorView(lambda, problem.m);
    inverse_.apply(x);
}

}  // namespace delassus
