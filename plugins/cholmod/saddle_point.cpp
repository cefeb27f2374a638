// SPDX-License-Identifier: BSD-3-Clause
#include "saddle_point.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace delassus_cholmod {

double inverse_root_power_of_two(double value) {
    return std::ldexp(1.0, -static_cast<int>(std::lround(0.5 * std::log2(value))));
}

Pair multiply(const ScaledSystem& system, const Pair& v) {
    Pair result;
    result.x = system.H * v.x;
    result.x.noalias() -= system.D.transpose() * v.lambda;
    result.lambda = system.D * v.x;
    if (system.E.nonZeros() > 0) result.lambda.noalias() += system.E * v.lambda;
    return result;
}

Pair residual(const delassus::sdk::ProblemView& problem, const Vector& x, const Vector& lambda) {
    std::vector<long double> momentum(problem.a.data(), problem.a.data() + problem.n);
    Pair result(problem.n, problem.m);
    for (Eigen::Index i = 0; i < problem.n; ++i)
        for (SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry)
            momentum[static_cast<std::size_t>(i)] -= static_cast<long double>(entry.value()) * x[entry.col()];
    for (Eigen::Index i = 0; i < problem.m; ++i) {
        long double velocity = problem.b[i];
        const long double reaction = lambda[i];
        for (SparseRowsView::InnerIterator entry(problem.D, i); entry; ++entry) {
            velocity += static_cast<long double>(entry.value()) * x[entry.col()];
            momentum[static_cast<std::size_t>(entry.col())] += entry.value() * reaction;
        }
        for (SparseRowsView::InnerIterator entry(problem.E, i); entry; ++entry)
            velocity += static_cast<long double>(entry.value()) * lambda[entry.col()];
        result.lambda[i] = -static_cast<double>(velocity);
    }
    for (Eigen::Index i = 0; i < problem.n; ++i)
        result.x[i] = static_cast<double>(momentum[static_cast<std::size_t>(i)]);
    return result;
}

double balance(const delassus::sdk::ProblemView& problem, const Vector& x, const Vector& lambda,
               const Vector& residual) {
    if (problem.n == 0) return 0.0;
    const double momentum = (problem.H * x).norm();
    const double impulse = (problem.D.transpose() * lambda).norm();
    const double reference = std::max({momentum, impulse, problem.a.norm()});
    return reference > 0.0 ? residual.norm() / reference : residual.norm();
}

}  // namespace delassus_cholmod
