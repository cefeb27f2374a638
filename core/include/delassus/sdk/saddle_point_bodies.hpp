// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/saddle_point.hpp (sdk/compiled_once.hpp).
#pragma once

#include <algorithm>
#include <cmath>

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/saddle_point.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION Vector magnitude_of_diagonal(const ProblemView& problem) {
    Vector diagonal = Vector::Zero(problem.n);
    for (Eigen::Index i = 0; i < problem.n; ++i)
        for (SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry)
            if (entry.col() == i) diagonal[i] = std::abs(entry.value());
    const auto positive = (diagonal.array() > 0.0).count();
    const double mean = positive > 0 ? diagonal.sum() / static_cast<double>(positive) : 1.0;
    for (auto& value : diagonal)
        if (!(value > 0.0)) value = mean;
    return diagonal;
}

DELASSUS_SDK_FUNCTION Vector stand_in_diagonal(const ProblemView& problem, const Vector& h) {
    Vector diagonal = Vector::Zero(problem.m);
    for (Eigen::Index i = 0; i < problem.m; ++i) {
        for (SparseRowsView::InnerIterator entry(problem.D, i); entry; ++entry)
            diagonal[i] += entry.value() * entry.value() / h[entry.col()];
        for (SparseRowsView::InnerIterator entry(problem.E, i); entry; ++entry)
            if (entry.col() == i) diagonal[i] += entry.value();
    }
    return diagonal;
}

DELASSUS_SDK_FUNCTION Vector saddle_point_scaling(const ProblemView& problem) {
    const auto power_of_two = [](double square) {  // the nearest to square^(−½)
        return square > 0.0 ? std::exp2(std::round(-0.5 * std::log2(square))) : 1.0;
    };
    Vector C = Vector::Ones(problem.n + problem.m);
    if (problem.needs_any(DELASSUS_CAN_H_INDEFINITE | DELASSUS_CAN_H_UNSYMMETRIC)) {
        for (int round = 0; round < 6; ++round) {
            Vector largest = Vector::Zero(problem.n);
            for (Eigen::Index i = 0; i < problem.n; ++i)
                for (SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry) {
                    const double value = std::abs(entry.value()) * C[i] * C[entry.col()];
                    largest[i] = std::max(largest[i], value);
                    largest[entry.col()] = std::max(largest[entry.col()], value);
                }
            for (Eigen::Index i = 0; i < problem.n; ++i) C[i] *= power_of_two(largest[i]);
        }
    } else {
        const Vector h = magnitude_of_diagonal(problem);
        for (Eigen::Index i = 0; i < problem.n; ++i) C[i] = power_of_two(h[i]);
    }
    for (Eigen::Index k = 0; k < problem.m; ++k) {
        double nu = 0.0;
        for (SparseRowsView::InnerIterator entry(problem.D, k); entry; ++entry)
            nu += entry.value() * entry.value() * C[entry.col()] * C[entry.col()];
        for (SparseRowsView::InnerIterator entry(problem.E, k); entry; ++entry)
            if (entry.col() == k) nu += std::abs(entry.value());
        C[problem.n + k] = power_of_two(nu);
    }
    return C;
}

DELASSUS_SDK_FUNCTION void apply_saddle_point_transposed(const ProblemView& problem, const Vector& w, Vector& result) {
    result.resize(problem.n + problem.m);
    result.head(problem.n) = problem.H.transpose() * w.head(problem.n) + problem.D.transpose() * w.tail(problem.m);
    result.tail(problem.m) = problem.D * w.head(problem.n);
    if (problem.E.nonZeros() > 0) result.tail(problem.m) -= problem.E.transpose() * w.tail(problem.m);
}

DELASSUS_SDK_FUNCTION void SaddlePointError::analyze(const ProblemView& problem) {
    definite_ =
        problem.n > 0 && problem.needs_any(DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS | DELASSUS_CAN_H_DEFINITE);
    unsymmetric_ = problem.needs_any(DELASSUS_CAN_H_UNSYMMETRIC);
    if (definite_ && problem.m > 0) N_.analyze(problem);
}

DELASSUS_SDK_FUNCTION void SaddlePointError::factorize(const ProblemView& problem) {
    if (problem.m == 0) return;
    if (definite_) {
        N_.factorize(problem);
        diagonal_ = N_.diagonal();
        return;
    }
    magnitude_ = magnitude_of_diagonal(problem);
    diagonal_ = stand_in_diagonal(problem, magnitude_);
    if (unsymmetric_) {
        lu_done_ = lu_.factorize(problem.H);
    }
}

DELASSUS_SDK_FUNCTION void SaddlePointError::begin(const ProblemView& problem) {
    if (problem.m == 0) return;
    Vector r = problem.b;
    if (definite_) {
        r = N_.free_velocity(problem);
    } else if (problem.n > 0) {
        Vector v;
        if (unsymmetric_ && lu_done_) v = lu_.solve(Vector(problem.a));
        if (v.size() == 0 || !v.allFinite()) v = problem.a.cwiseQuotient(magnitude_);
        r += problem.D * v;
    }
    natural_ = NaturalResidual(problem, diagonal_, r);
}

DELASSUS_SDK_FUNCTION SaddlePointError::Value SaddlePointError::measure(const ProblemView& problem,
                                                                        const Eigen::Ref<const Vector>& x,
                                                                        const Eigen::Ref<const Vector>& lambda,
                                                                        Vector* residual) {
    const Eigen::Index n = problem.n, m = problem.m;
    forces_.assign(static_cast<std::size_t>(n), 0.0L);
    u_.resize(m);
    for (Eigen::Index k = 0; k < m; ++k) {
        long double sum = problem.b[k];
        for (SparseRowsView::InnerIterator entry(problem.D, k); entry; ++entry) {
            const long double value = entry.value();
            sum += value * x[entry.col()];
            forces_[static_cast<std::size_t>(entry.col())] += value * lambda[k];
        }
        for (SparseRowsView::InnerIterator entry(problem.E, k); entry; ++entry)
            sum += static_cast<long double>(entry.value()) * lambda[entry.col()];
        u_[k] = static_cast<double>(sum);
    }
    if (residual) residual->resize(n + m);
    long double rest = 0.0L, inertia = 0.0L, forces = 0.0L;
    for (Eigen::Index i = 0; i < n; ++i) {
        long double sum = 0.0L;
        for (SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry)
            sum += static_cast<long double>(entry.value()) * x[entry.col()];
        const long double force = forces_[static_cast<std::size_t>(i)];
        const long double gap = problem.a[i] + force - sum;
        rest += gap * gap;
        inertia += sum * sum;
        forces += force * force;
        if (residual) (*residual)[i] = static_cast<double>(gap);
    }
    if (residual) residual->tail(m) = -u_;
    const auto scale = std::sqrt(std::max(
        {static_cast<double>(inertia), static_cast<double>(forces), static_cast<double>(problem.a.squaredNorm())}));
    Value value;
    const double balance = std::sqrt(static_cast<double>(rest));
    value.balance = scale > 0.0 ? balance / scale : balance;
    value.natural = m > 0 ? natural_.natural(lambda, u_) : 0.0;
    if (!std::isfinite(value.balance) || !std::isfinite(value.natural)) return {};
    return value;
}

}  // namespace delassus::sdk
