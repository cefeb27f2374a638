// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/linear_problem.hpp"

#include <fmt/format.h>

#include <cmath>

#include "support/finite.hpp"

namespace delassus {

std::vector<Cone> free_cones(const DynamicalSystem& system) {
    std::vector<Cone> cones;
    for (const auto rows : system.constraint_blocks()) cones.push_back(Cone::free(rows));
    return cones;
}

void multiply_blocks(const std::vector<DiagonalBlock3>& blocks, const Vector& vector, Vector& result) {
    result = vector;
    for (const auto& block : blocks)
        result.segment<3>(block.first) = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(block.value) *
                                         vector.segment<3>(block.first);
}

void require_step(const DynamicalSystem& system, const State& begin, double h, std::string_view method) {
    if (!(h > 0.0) || !std::isfinite(h))
        throw InputError(fmt::format("{} was given a step of {}; it must be positive and finite", method, h));
    const auto positions = static_cast<std::size_t>(system.position_size()), n = static_cast<std::size_t>(system.n());
    if (begin.q.size() != positions || begin.v.size() != n)
        throw InputError(fmt::format("{} was given a state of {} positions and {} velocities; the system has {} and {}",
                                     method, begin.q.size(), begin.v.size(), positions, n));
}

void require_finite(const State& begin, const State& end, double h, std::string_view method) {
    if (!all_finite(end.q) || !all_finite(end.v))
        throw StepFailure(fmt::format("{} cannot take the step from t = {:.9g} with h = {:.9g}: its end is not finite",
                                      method, begin.t, h));
}

LinearSolution solve_linear(Problem problem, StepSolver& solver, StepReport& report, std::string_view name) {
    problem.name = name;
    const auto n = problem.n(), m = problem.m();
    Solution solution;
    report.take(solver.solve(std::move(problem), solution));
    ++report.newton_iterations;
    return {Eigen::Map<const Vector>(solution.x.data(), n), Eigen::Map<const Vector>(solution.lambda.data(), m)};
}

Accelerations::Accelerations(const DynamicalSystem& system)
    : system_(system), cones_(free_cones(system)), n_(system.n()), m_(system.m()) {}

LinearSolution Accelerations::at(const State& state, StepSolver& solver, StepReport& report) {
    LinearSolution solution;
    at(state, solver, report, solution);
    return solution;
}

void Accelerations::at(const State& state, StepSolver& solver, StepReport& report, LinearSolution& solution) {
    const auto require_finite_result = [&] {
        if (!solution.x.allFinite() || !solution.lambda.allFinite())
            throw StepFailure(fmt::format("the accelerations at t = {} are not finite", state.t));
    };
    if (m_ == 0 && solver.leaves_out()) {
        solution.x.resize(n_);
        solution.lambda.resize(0);
        if (system_.accelerate(state, solution.x.data())) {
            ++report.newton_iterations;
            return require_finite_result();
        }
    }
    Problem problem;
    M_.begin(n_, n_);
    system_.add_mass(state, 1.0, M_);
    problem.H = M_.finish();
    problem.a.assign(static_cast<std::size_t>(n_), 0.0);
    system_.add_force(state, 1.0, problem.a.data());
    problem.b.assign(static_cast<std::size_t>(m_), 0.0);
    D_.begin(m_, n_);
    if (m_ > 0) {
        system_.add_constraint_jacobian(state, 0, D_);
        system_.constraint_curvature(state, problem.b.data());
    }
    problem.D = D_.finish();
    problem.cones = cones_;
    if (!Eigen::Map<const Vector>(problem.a.data(), n_).allFinite() ||
        !Eigen::Map<const Vector>(problem.b.data(), m_).allFinite())
        throw StepFailure(fmt::format("the forces at t = {} are not finite", state.t));
    solution = solve_linear(std::move(problem), solver, report);
    require_finite_result();
}

}  // namespace delassus
