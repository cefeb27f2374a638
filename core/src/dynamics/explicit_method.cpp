// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/explicit_method.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "dynamics/return_to_constraints.hpp"
#include "dynamics/way_of_step.hpp"

namespace delassus {

ExplicitMethod::ExplicitMethod(DynamicalSystem& system, ButcherTableau tableau, double error_limit)
    : system_(system),
      tableau_(std::move(tableau)),
      error_limit_(error_limit),
      accelerations_(system),
      n_(system.n()),
      m_(system.m()),
      cones_(free_cones(system)) {
    u_.assign(tableau_.b.size(), Vector::Zero(n_));
    v_ = u_;
    increment_.setZero(n_);
    stage_v_.setZero(n_);
}

void ExplicitMethod::restart() {
    known_ = false;
    multipliers_.clear();
}

EmbeddedError ExplicitMethod::embedded_error() const {
    return {{error_q_.data(), static_cast<std::size_t>(error_q_.size())},
            {error_v_.data(), static_cast<std::size_t>(error_v_.size())}};
}

std::vector<double> ExplicitMethod::save() const {
    if (!known_) return {};
    std::vector<double> memory = {known_at_.t};
    memory.insert(memory.end(), known_at_.q.begin(), known_at_.q.end());
    memory.insert(memory.end(), known_at_.v.begin(), known_at_.v.end());
    memory.insert(memory.end(), last_.x.begin(), last_.x.end());
    memory.insert(memory.end(), last_.lambda.begin(), last_.lambda.end());
    return memory;
}

void ExplicitMethod::load(const std::vector<double>& memory) {
    restart();
    if (memory.empty()) return;
    const auto q = static_cast<std::ptrdiff_t>(system_.position_size());
    if (static_cast<std::ptrdiff_t>(memory.size()) != 1 + q + 2 * n_ + m_)
        throw InputError(fmt::format("the memory of {} is of another system", tableau_.name));
    auto at = memory.begin() + 1;
    known_at_.t = memory.front();
    known_at_.q.assign(at, at + q);
    at += q;
    known_at_.v.assign(at, at + n_);
    at += n_;
    last_.x = Eigen::Map<const Vector>(memory.data() + (at - memory.begin()), n_);
    at += n_;
    last_.lambda.resize(m_);
    std::copy(at, memory.end(), last_.lambda.data());
    known_ = true;
}

/// last_ ← the accelerations at the state, if they are not known from the end of the last step.
void ExplicitMethod::begin(const State& state, StepSolver& solver, StepReport& report) {
    if (known_ && known_at_.t == state.t && known_at_.q == state.q && known_at_.v == state.v) return;
    accelerations_.at(state, solver, report, last_);
}

void ExplicitMethod::take_step(State& state, double h, StepSolver& solver, StepReport& report) {
    require_step(system_, state, h, tableau_.name);
    const Eigen::Map<const Vector> v(state.v.data(), n_);
    const auto sum = [&](std::span<const double> factors, const std::vector<Vector>& slopes, Vector& result) {
        for (std::size_t j = 0; j < factors.size(); ++j)
            if (factors[j] != 0.0) result.noalias() += (h * factors[j]) * slopes[j];
    };
    begin(state, solver, report);
    u_[0] = v;
    v_[0] = last_.x;
    stage_.q.resize(state.q.size());
    stage_.v.resize(state.v.size());
    for (std::size_t i = 1; i < tableau_.b.size(); ++i) {
        const auto row = tableau_.a.subspan(i * (i - 1) / 2, i);
        increment_.setZero(n_);
        sum(row, u_, increment_);
        stage_v_ = v;
        sum(row, v_, stage_v_);
        system_.increment(state.q.data(), increment_.data(), stage_.q.data());
        std::copy(stage_v_.begin(), stage_v_.end(), stage_.v.begin());
        stage_.t = state.t + tableau_.c[i] * h;
        system_.inverse_tangent(increment_.data(), blocks_);
        multiply_blocks(blocks_, stage_v_, u_[i]);
        accelerations_.at(stage_, solver, report, solution_);
        v_[i] = solution_.x;
    }
    increment_.setZero(n_);
    sum(tableau_.b, u_, increment_);
    stage_v_ = v;
    sum(tableau_.b, v_, stage_v_);
    end_.q.resize(state.q.size());
    end_.v.resize(state.v.size());
    system_.increment(state.q.data(), increment_.data(), end_.q.data());
    std::copy(stage_v_.begin(), stage_v_.end(), end_.v.begin());
    end_.t = state.t + h;
    require_finite(state, end_, h, tableau_.name);
    if (m_ > 0) {
        return_to_constraints(state, h, solver, report);
        require_finite(state, end_, h, tableau_.name);
    }
    known_ = m_ > 0 || !tableau_.error.empty();
    if (known_) {
        accelerations_.at(end_, solver, report, last_);
        known_at_ = end_;
        multipliers_.assign(last_.lambda.begin(), last_.lambda.end());
        report.multipliers = multipliers_;
    }
    if (!tableau_.error.empty()) {
        error_q_.setZero(n_);
        error_v_.setZero(n_);
        sum(tableau_.error.first(tableau_.b.size()), u_, error_q_);
        sum(tableau_.error.first(tableau_.b.size()), v_, error_v_);
        system_.inverse_tangent(increment_.data(), blocks_);
        stage_v_ = Eigen::Map<const Vector>(end_.v.data(), n_);
        multiply_blocks(blocks_, stage_v_, u_[0]);
        error_q_ += h * tableau_.error.back() * u_[0];
        error_v_ += h * tableau_.error.back() * last_.x;
    }
    std::swap(state, end_);
    stepped_ = true;
}

// By powers of θ: h k_1, 3 δ − 2 h k_1 − h k_{s+1} + e, h k_1 + h k_{s+1} − 2 δ − 2 e, e with e = h Σ d_i k_i.
void ExplicitMethod::extend(ContinuousExtension& way) const {
    way.degree = 0;
    if (tableau_.dense.empty() || !known_ || !stepped_) return;
    way.begin = end_;
    way.end = known_at_;
    way.degree = 4;
    way.multipliers.assign(last_.lambda.begin(), last_.lambda.end());
    way.multiplier_powers.clear();
    const double h = way.end.t - way.begin.t;
    const auto as_vector = [](const std::vector<double>& values) {
        return Eigen::Map<const Vector>(values.data(), static_cast<Eigen::Index>(values.size()));
    };
    const auto describe = [&](const auto& first, const std::vector<Vector>& slopes, const auto& last, const auto& delta,
                              std::vector<double>& powers) {
        powers.resize(4 * static_cast<std::size_t>(n_));
        const auto power = [&](Eigen::Index k) { return Eigen::Map<Vector>(powers.data() + (k - 1) * n_, n_); };
        auto fourth = power(4);
        fourth = (h * tableau_.dense.front()) * first + (h * tableau_.dense.back()) * last;
        for (std::size_t i = 1; i < slopes.size(); ++i)
            if (tableau_.dense[i] != 0.0) fourth += (h * tableau_.dense[i]) * slopes[i];
        power(1) = h * first;
        power(2) = 3.0 * delta - 2.0 * h * first - h * last + fourth;
        power(3) = h * first + h * last - 2.0 * delta - 2.0 * fourth;
    };
    Vector delta = increment_;
    if (m_ > 0) meet_end(system_, way.begin, way.end, delta);
    std::vector<DiagonalBlock3> blocks;
    Vector last;
    system_.inverse_tangent(delta.data(), blocks);
    multiply_blocks(blocks, as_vector(way.end.v), last);
    describe(as_vector(way.begin.v), u_, last, delta, way.positions);
    describe(v_[0], v_, last_.x, as_vector(way.end.v) - as_vector(way.begin.v), way.velocities);
}

Problem ExplicitMethod::nearest(const State& state) {
    Problem problem;
    M_.begin(n_, n_);
    system_.add_mass(state, 1.0, M_);
    problem.H = M_.finish();
    D_.begin(m_, n_);
    system_.add_constraint_jacobian(state, 0, D_);
    problem.D = D_.finish();
    problem.a.assign(static_cast<std::size_t>(n_), 0.0);
    problem.cones = cones_;
    return problem;
}

void ExplicitMethod::return_to_constraints(const State& begin, double h, StepSolver& solver, StepReport& report) {
    const auto least = [&](const std::vector<double>& off) -> const Vector& {
        Problem problem = nearest(end_);
        problem.b = off;
        solution_ = solve_linear(std::move(problem), solver, report);
        return solution_.x;
    };
    return_positions(system_, tableau_.name, begin, end_, h, least);
    D_.begin(m_, n_);
    system_.add_constraint_jacobian(end_, 0, D_);
    return_velocities(system_, tableau_.name, begin, end_, h, D_.finish(), least);
}

}  // namespace delassus
