// SPDX-License-Identifier: BSD-3-Clause
#include "scaled_system.hpp"

#include <algorithm>

namespace delassus::admm {

void ScaledSystem::load(const sdk::ProblemView& problem) {
    problem_ = &problem;
    const sdk::Vector r = scaling_.free_velocity(problem);
    law_.load(problem, scaling_.scale());
    resolvent_.load(problem, r);
    natural_.assign(problem, scaling_.diagonal(), r);
}

sdk::Vector ScaledSystem::velocities(const sdk::Vector& lambda, const sdk::Vector& x) const {
    sdk::Vector u = problem_->b;
    if (problem_->n > 0) u.noalias() += problem_->D * x;
    if (problem_->E.nonZeros() > 0) u.noalias() += problem_->E * lambda;
    return u;
}

double ScaledSystem::claim(const sdk::Vector& lambda, sdk::Vector& x) const {
    if (definite()) {
        x = velocity(lambda);
        return natural(lambda, velocities(lambda, x));
    }
    const sdk::Vector momentum = problem_->H * x;
    const sdk::Vector impulse = problem_->D.transpose() * lambda;
    const double rest = (momentum - impulse - problem_->a).norm();
    const double largest = std::max({momentum.norm(), impulse.norm(), problem_->a.norm()});
    return std::max(natural(lambda, velocities(lambda, x)), largest > 0.0 ? rest / largest : rest);
}

}  // namespace delassus::admm
