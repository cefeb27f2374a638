// SPDX-License-Identifier: BSD-3-Clause
// Linear problems of timesteppers: all rows are bilateral constraints (internal).
#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "delassus/dynamical_system.hpp"
#include "delassus/timestepper.hpp"

namespace delassus {

using Vector = Eigen::VectorXd;

struct LinearSolution {
    Vector x, lambda;  ///< n, m
};

/// A free cone for each block of constraints.
std::vector<Cone> free_cones(const DynamicalSystem& system);

/// result ← blocks · vector, for the blocks in which a matrix differs from the identity.
void multiply_blocks(const std::vector<DiagonalBlock3>& blocks, const Vector& vector, Vector& result);

/// Throws InputError unless h > 0 is finite and the state has the system's sizes.
void require_step(const DynamicalSystem& system, const State& begin, double h, std::string_view method);

/// Throws StepFailure if the end of a step holds a number that is not finite.
void require_finite(const State& begin, const State& end, double h, std::string_view method);

/// Solves, and counts it in the report. What was prepared for problems of the same name serves again.
LinearSolution solve_linear(Problem problem, StepSolver& solver, StepReport& report, std::string_view name = "step");

/// Accelerations and multipliers that fit a state: M v̇ − C_qᵀ λ = f,  C_q v̇ + (C_q v)_q v + 2 C_qt v + C_tt = 0.
class Accelerations {
public:
    /// system outlives it.
    explicit Accelerations(const DynamicalSystem& system);

    /// Throws StepFailure if they are not finite.
    LinearSolution at(const State& state, StepSolver& solver, StepReport& report);
    /// The same where memory serves again. Without constraints by the system's own way, if it has one.
    void at(const State& state, StepSolver& solver, StepReport& report, LinearSolution& solution);

private:
    const DynamicalSystem& system_;
    std::vector<Cone> cones_;
    std::int32_t n_, m_;
    MatrixAssembler M_, D_;
};

}  // namespace delassus
