// SPDX-License-Identifier: BSD-3-Clause
#include "scaled_system.hpp"

#include <algorithm>

#include "delassus/sdk/saddle_point.hpp"

namespace delassus::ipm {

std::vector<Group> groups_of(const sdk::ProblemView& problem) {
    std::vector<Group> groups;
    for (const delassus_cone& cone : problem.cones) {
        if (cone.kind == DELASSUS_CONE_FRICTION) {
            groups.push_back({cone.first_row, cone.rows});
        } else {
            for (std::int32_t i = 0; i < cone.rows; ++i) groups.push_back({cone.first_row + i, 1});
        }
    }
    return groups;
}

void Scaling::analyze(const sdk::ProblemView& problem) {
    definite_ = problem.n == 0 || !problem.needs_any(DELASSUS_CAN_H_SEMIDEFINITE);
    if (definite_) operator_.analyze(problem);
}

void Scaling::factorize(const sdk::ProblemView& problem) {
    h_ = sdk::magnitude_of_diagonal(problem);
    if (definite_) operator_.factorize(problem);
    diagonal_ = definite_ ? operator_.diagonal() : sdk::stand_in_diagonal(problem, h_);
}

void Scaling::load(const sdk::ProblemView& problem) {
    sdk::Vector r = problem.b;
    if (definite_) {
        r = operator_.free_velocity(problem);
    } else {
        r += problem.D * problem.a.cwiseQuotient(h_);
    }
    residual_ = sdk::NaturalResidual(problem, diagonal_, r);
    double rho = residual_.reference();
    if (problem.m == 0 && problem.n > 0)
        if (const double size = problem.a.cwiseQuotient(h_.cwiseSqrt()).norm(); size > 0.0) rho = size;

    const double positive = static_cast<double>((diagonal_.array() > 0.0).count());
    const double mean = positive > 0.0 ? diagonal_.sum() / positive : 1.0;
    const sdk::Vector p = row_scale(problem.cones, diagonal_, mean);
    const sdk::Vector R = h_.cwiseSqrt().cwiseInverse();
    system_.x_scale = rho * R;
    system_.z_scale = rho * p;
    system_.a = problem.a.cwiseProduct(R) / rho;
    system_.b = problem.b.cwiseProduct(p) / rho;
    system_.H = R.asDiagonal() * sdk::SparseColumns(problem.H) * R.asDiagonal();
    system_.D = p.asDiagonal() * sdk::SparseRows(problem.D) * R.asDiagonal();
    system_.E = p.asDiagonal() * sdk::SparseColumns(problem.E) * p.asDiagonal();
}

double Scaling::measure(const sdk::ProblemView& problem, sdk::Vector& x, const sdk::Vector& lambda) const {
    double balance = 0.0;
    if (definite_) {
        x = operator_.velocity(problem, lambda);
    } else {
        const sdk::Vector momentum = problem.H * x, impulse = problem.D.transpose() * lambda;
        const double size = std::max({momentum.norm(), impulse.norm(), problem.a.norm()});
        balance = (momentum - impulse - problem.a).norm() / (size > 0.0 ? size : 1.0);
        if (!(balance > 1e-12)) balance = 0.0;  // the host accepts it
    }
    if (problem.m == 0) return balance;
    sdk::Vector u = problem.b;
    if (problem.n > 0) u.noalias() += problem.D * x;
    if (problem.E.nonZeros() > 0) u.noalias() += problem.E * lambda;
    return std::max(residual_.natural(lambda, u), balance);
}

}  // namespace delassus::ipm
