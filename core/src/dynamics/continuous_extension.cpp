// SPDX-License-Identifier: BSD-3-Clause
// A polynomial leaves constraints that turn by its own error. What moves it back is as in dynamics/explicit_method.hpp:
//
//     M x − C_qᵀ μ = 0,   C_q x = −C,                q ← q ∘ exp(x), until C is rounding
//     M x − C_qᵀ μ = 0,   C_q x = −(C_q v + C_t),    v ← v + x, likewise
//
// with M and C_q of the polynomial for both: they are a local error away from those of the result, so that each change
// leaves that share of what it removes.
#include "delassus/continuous_extension.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "dynamics/linear_problem.hpp"
#include "dynamics/return_to_constraints.hpp"
#include "dynamics/way_of_step.hpp"

namespace delassus {

struct DenseOutput::Implementation {
    explicit Implementation(DynamicalSystem& one)
        : system(one), accelerations(one), n(one.n()), m(one.m()), cones(free_cones(one)) {}

    /// Σ_{k ≥ first} θᵏ of the coefficients, the result's size each.
    static void polynomial(const std::vector<double>& coefficients, int first, double theta, Vector& result) {
        const auto size = result.size();
        result.setZero();
        for (auto k = static_cast<Eigen::Index>(coefficients.size()) / std::max<Eigen::Index>(size, 1); k-- > 0;)
            result = theta * result + Eigen::Map<const Vector>(coefficients.data() + k * size, size);
        if (first == 1) result *= theta;
    }
    /// θ
    static double place(const ContinuousExtension& way, double t) {
        return (t - way.begin.t) / (way.end.t - way.begin.t);
    }
    void return_to_constraints(const State& begin, State& state, StepSolver& solver, StepReport& report);

    DynamicalSystem& system;
    Accelerations accelerations;
    std::int32_t n, m;
    std::vector<Cone> cones;
    Vector value;
    LinearSolution solution;
    MatrixAssembler M, D, now;
};

void DenseOutput::Implementation::return_to_constraints(const State& begin, State& state, StepSolver& solver,
                                                        StepReport& report) {
    M.begin(n, n);
    system.add_mass(state, 1.0, M);
    const SparseMatrix& mass = M.finish();
    D.begin(m, n);
    system.add_constraint_jacobian(state, 0, D);
    const SparseMatrix& jacobian = D.finish();
    const auto least = [&](const std::vector<double>& off) -> const Vector& {
        Problem problem;
        problem.H = mass;
        problem.D = jacobian;
        problem.a.assign(static_cast<std::size_t>(n), 0.0);
        problem.b = off;
        problem.cones = cones;
        solution = solve_linear(std::move(problem), solver, report);
        return solution.x;
    };
    const double h = state.t - begin.t;
    return_positions(system, "dense output", begin, state, h, least);
    now.begin(m, n);
    system.add_constraint_jacobian(state, 0, now);
    return_velocities(system, "dense output", begin, state, h, now.finish(), least);
}

DenseOutput::DenseOutput(DynamicalSystem& system) : implementation_(std::make_unique<Implementation>(system)) {}
DenseOutput::~DenseOutput() = default;

void DenseOutput::at(const ContinuousExtension& way, double t, State& state, StepSolver& solver, StepReport& report) {
    auto& self = *implementation_;
    read(way, t, state);
    if (t != way.end.t && self.m > 0) self.return_to_constraints(way.begin, state, solver, report);
}

void DenseOutput::read(const ContinuousExtension& way, double t, State& state) {
    auto& self = *implementation_;
    if (t == way.end.t) {
        state = way.end;
        return;
    }
    if (way.degree == 0 || !(t >= way.begin.t && t <= way.end.t))
        throw InputError(
            fmt::format("a state at t = {:.9g} is asked for, which the step does not pass: it goes from {:.9g} to "
                        "{:.9g}",
                        t, way.degree == 0 ? way.end.t : way.begin.t, way.end.t));
    const double theta = Implementation::place(way, t);
    self.value.resize(self.n);
    Implementation::polynomial(way.positions, 1, theta, self.value);
    state.t = t;
    state.q.resize(way.begin.q.size());
    self.system.increment(way.begin.q.data(), self.value.data(), state.q.data());
    Implementation::polynomial(way.velocities, 1, theta, self.value);
    state.v = way.begin.v;
    for (std::size_t i = 0; i < state.v.size(); ++i) state.v[i] += self.value[static_cast<Eigen::Index>(i)];
    require_finite(way.begin, state, t - way.begin.t, "dense output");
}

std::vector<double> DenseOutput::multipliers(const ContinuousExtension& way, const State& state, StepSolver& solver,
                                             StepReport& report) {
    auto& self = *implementation_;
    if (self.m == 0) return {};
    if (state.t == way.end.t && !way.multipliers.empty()) return way.multipliers;
    if (way.multiplier_powers.empty()) {
        self.accelerations.at(state, solver, report, self.solution);
        return {self.solution.lambda.begin(), self.solution.lambda.end()};
    }
    self.value.resize(self.m);
    Implementation::polynomial(way.multiplier_powers, 0, Implementation::place(way, state.t), self.value);
    return {self.value.begin(), self.value.end()};
}

// With exp(Δ + T⁻¹(Δ) x) = exp(Δ) ∘ exp(x) + O(x²): Newton's method, of which two iterations are enough where x is a
// local error.
void meet_end(const DynamicalSystem& system, const State& begin, const State& end, Vector& increment) {
    std::vector<double> q(begin.q.size()), off(begin.v.size());
    std::vector<DiagonalBlock3> blocks;
    Vector change;
    for (int i = 0; i < 2; ++i) {
        system.increment(begin.q.data(), increment.data(), q.data());
        system.difference(q.data(), end.q.data(), off.data());
        system.inverse_tangent(increment.data(), blocks);
        multiply_blocks(blocks, Eigen::Map<const Vector>(off.data(), increment.size()), change);
        increment += change;
    }
}

void Timestepper::extend(ContinuousExtension& way) const {
    way.degree = 0;
}

}  // namespace delassus
