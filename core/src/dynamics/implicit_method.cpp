// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/implicit_method.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace delassus {

// A joint holds its coordinate whatever the force: a motion of infinite frequency. With Δ = 0 in every step the
// equations of ImplicitCoefficients leave, after elimination of v,
//
//     p₁ a_{n+2} + (p₀ − p₁ + v₁) a_{n+1} + (v₀ − p₀) a_n = 0,      p₀, p₁ = position_old, position_new, v likewise
//
// and v̇ follows a with the factors −α_f/(1 − α_f). Newmark's are β z² + (½ + γ − 2β) z + ½ − γ + β = 0 (Cardona and
// Géradin, Computers and Structures 33, 1989): a root lies beyond −1 where β < ½γ, and γ = ½ leaves the product of
// the roots at 1, so that nothing decays.
double ImplicitCoefficients::reaction_growth() const {
    const double half = 0.5 * (position_old - position_new + velocity_new) / position_new;
    const double product = (velocity_old - position_old) / position_new, discriminant = half * half - product;
    const double root =
        discriminant < 0.0 ? std::sqrt(product) : std::abs(half) + std::sqrt(std::max(discriminant, 0.0));
    return std::max(root, alpha_f / (1.0 - alpha_f));
}

ImplicitMethod::ImplicitMethod(DynamicalSystem& system, ImplicitCoefficients coefficients, NewtonSettings settings)
    : system_(system),
      method_(settings.method),
      c_(coefficients),
      accelerations_(system),
      newton_(system, std::move(settings)),
      n_(system.n()),
      m_(system.m()) {
    constexpr double rounding = 1e-6;  // double roots lose half of the digits
    if (const double growth = c_.reaction_growth(); m_ > 0 && growth > 1.0 + rounding)
        throw Unsupported(fmt::format(
            "{} takes no joints with these options: their reactions would grow by the factor {:.3g} in each step; take "
            "beta ≥ gamma/2",
            method_, growth));
    restart();
}

void ImplicitMethod::restart() {
    started_ = false;
    multipliers_.clear();
    v_dot_.setZero(n_);
    a_.setZero(n_);
    newton_.forget();
}

// With a_{n+1} eliminated, v and v̇ are affine in Δ, of slopes
//
//     γ′ = velocity_new / (h position_new),      β′ = (1 − α_m) / ((1 − α_f) h² position_new)
//
// Newton starts from one of two points. Either the acceleration stays, v̇_{n+1} = v̇_n, which is off by O(h³) in the
// position. In a stiff system, h² v̇_n may be a far way, from where rounding alone spoils the result (h² ω² = 1e16 for
// h ω = 1e8); then the body rests, Δ = 0. The one with the smaller ‖r‖ is taken.

StepPoint ImplicitMethod::steady(const State& begin, double h, const Vector& lambda) const {
    StepPoint point{begin, {}, v_dot_, lambda};
    const Vector a = (v_dot_ - c_.alpha_m * a_) / (1.0 - c_.alpha_m);
    const Eigen::Map<const Vector> v(begin.v.data(), n_);
    point.delta = h * v + h * h * (c_.position_old * a_ + c_.position_new * a);
    Eigen::Map<Vector>(point.state.v.data(), n_) = v + h * (c_.velocity_old * a_ + c_.velocity_new * a);
    point.state.t = begin.t + h;
    return point;
}

StepPoint ImplicitMethod::resting(const State& begin, double h, StepSlopes slopes, const Vector& lambda) const {
    StepPoint point{begin, Vector::Zero(n_), {}, lambda};
    const Eigen::Map<const Vector> v(begin.v.data(), n_);
    const double ratio = c_.velocity_new / c_.position_new;
    Eigen::Map<Vector>(point.state.v.data(), n_) =
        (1.0 - ratio) * v + h * (c_.velocity_old - ratio * c_.position_old) * a_;
    point.acceleration = -slopes.beta * (h * v + h * h * c_.position_old * a_) +
                         (c_.alpha_m * a_ - c_.alpha_f * v_dot_) / (1.0 - c_.alpha_f);
    point.state.t = begin.t + h;
    return point;
}

void ImplicitMethod::take_step(State& state, double h, StepSolver& solver, StepReport& report) {
    require_step(system_, state, h, method_);
    Vector lambda = Vector::Zero(m_);
    if (!multipliers_.empty()) lambda = Eigen::Map<const Vector>(multipliers_.data(), m_);
    if (!started_ && c_.remembers()) {
        auto consistent = accelerations_.at(state, solver, report);
        v_dot_ = a_ = consistent.x;
        lambda = consistent.lambda;
    }
    const StepSlopes slopes = {c_.velocity_new / (h * c_.position_new),
                               (1.0 - c_.alpha_m) / ((1.0 - c_.alpha_f) * h * h * c_.position_new)};
    StepPoint point = steady(state, h, lambda);
    StepResidual residual;
    const bool finite = newton_.evaluate(state, point, residual);
    StepPoint other = resting(state, h, slopes, lambda);
    StepResidual other_residual;
    if (newton_.evaluate(state, other, other_residual) &&
        !(finite && residual.balance.norm() <= other_residual.balance.norm())) {
        std::swap(point, other);
        std::swap(residual, other_residual);
    }
    newton_.solve(state, h, slopes, point, residual, solver, report);

    a_ = ((1.0 - c_.alpha_f) * point.acceleration + c_.alpha_f * v_dot_ - c_.alpha_m * a_) / (1.0 - c_.alpha_m);
    v_dot_ = point.acceleration;
    multipliers_.assign(point.lambda.begin(), point.lambda.end());
    report.multipliers = multipliers_;
    started_ = true;
    state = std::move(point.state);
}

std::vector<double> ImplicitMethod::save() const {
    std::vector<double> memory = {started_ ? 1.0 : 0.0};
    if (!started_) return memory;
    memory.insert(memory.end(), v_dot_.begin(), v_dot_.end());
    memory.insert(memory.end(), a_.begin(), a_.end());
    memory.insert(memory.end(), multipliers_.begin(), multipliers_.end());
    newton_.save(memory);
    return memory;
}

void ImplicitMethod::load(const std::vector<double>& memory) {
    restart();
    if (memory.empty() || memory[0] == 0.0) return;
    const auto fixed = static_cast<std::size_t>(1 + 2 * n_ + m_);
    if (memory.size() <= fixed) throw InputError("a timestepper's memory is too short for the system");
    v_dot_ = Eigen::Map<const Vector>(memory.data() + 1, n_);
    a_ = Eigen::Map<const Vector>(memory.data() + 1 + n_, n_);
    multipliers_.assign(memory.begin() + 1 + 2 * n_, memory.begin() + static_cast<std::ptrdiff_t>(fixed));
    newton_.load(memory.data() + fixed, memory.data() + memory.size());
    started_ = true;
}

}  // namespace delassus
