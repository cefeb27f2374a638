// SPDX-License-Identifier: BSD-3-Clause
// Newton's method for the end of an implicit step, shared by the methods in integrators/ (internal).
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/timestepper.hpp"
#include "dynamics/linear_problem.hpp"
#include "dynamics/linearization.hpp"

namespace delassus {

/// When H and D are assembled anew. The residual is exact with each of them, and a step that one of the latter two does
/// not find is tried again with the first.
enum class Reuse {
    Full,      ///< in every iteration
    Modified,  ///< once a step, and again where an iteration does not halve the residual
    Adaptive   ///< kept from step to step while h stays, until an iteration does not take the residual to a tenth
};

/// The matrix of the iteration.
enum class Jacobian {
    Automatic,  ///< the derivative where the problem is small, has no rows, and so goes to no plugin; else symmetric
    Symmetric,  ///< the symmetric part of the derivative, which more solvers take
    Exact       ///< the derivative
};

struct NewtonSettings {
    std::string method;  ///< for messages
    Jacobian jacobian = Jacobian::Exact;
    Reuse reuse = Reuse::Full;
    double tolerance = 1e-10;
    int max_iterations = 20;
    bool linearized = false;                ///< one iteration; what it left is measured against linearization_limit
    double linearization_limit = HUGE_VAL;  ///< of its error (dynamics/linearization.hpp)
    double largest_turn = HUGE_VAL;         ///< of a body in a step, rad
    bool watchdog = false;                  ///< the residual may grow for one iteration before increments are halved
};

/// v = v₀ + γ′ Δ and v̇ = v̇₀ + β′ Δ in a step whose positions are q = q_n ∘ exp(Δ).
struct StepSlopes {
    double gamma = 0.0;  ///< γ′ = ∂v/∂Δ, 1/s
    double beta = 0.0;   ///< β′ = ∂v̇/∂Δ, 1/s²
};

/// A guess of the end of a step, and its end.
struct StepPoint {
    State state;          ///< t, v given; q follows from delta
    Vector delta;         ///< Δ, n
    Vector acceleration;  ///< v̇, n
    Vector lambda;        ///< λ, m; forces
};

/// M v̇ − f − C_qᵀ λ, its three terms, and C, at a point.
struct StepResidual {
    Vector inertia, force, reaction;  ///< M v̇, f, C_qᵀ λ; n
    Vector balance;                   ///< n
    Vector constraint;                ///< C; m
};

class DELASSUS_API Newton {
public:
    /// system outlives it.
    Newton(DynamicalSystem& system, NewtonSettings settings);

    /// A force beside f, n, which stays during a step; empty: none.
    void set_load(Vector load) { load_ = std::move(load); }

    /// point.state.q ← q ∘ exp(delta), and the residual there. False if a number in it is not finite.
    bool evaluate(const State& begin, StepPoint& point, StepResidual& residual);

    /// H/β′ and C_q at an evaluated point. Valid until the next call.
    const SparseMatrix& matrix(const StepPoint& point, StepSlopes slopes);
    const SparseMatrix& jacobian(const State& state);

    /// Moves point, a guess of the end of the step from begin, to the solution. residual is that of the guess. Throws
    /// StepFailure.
    void solve(const State& begin, double h, StepSlopes slopes, StepPoint& point, StepResidual& residual,
               StepSolver& solver, StepReport& report);

    /// Drops the matrices kept from earlier steps.
    void forget() { kept_.valid = false; }

    /// The kept matrices as numbers, and back; returns where the numbers end.
    void save(std::vector<double>& memory) const;
    const double* load(const double* memory, const double* end);

private:
    class Iteration;
    struct Kept {
        bool valid = false;
        StepSlopes slopes;
        SparseMatrix H, D;
    };
    void assemble(const StepPoint& point, StepSlopes slopes);
    void scale();
    [[nodiscard]] double merit(const StepResidual& residual, double s) const;
    /// Throws StepFailure where a body turns too far in Δ.
    void judge_turns(const State& begin, double h, const Vector& delta);

    DynamicalSystem& system_;
    NewtonSettings settings_;
    Linearization linearization_;
    bool starts_exact_;  // a step begins with the derivative, not with its symmetric part
    bool exact_;         // the one in use
    std::vector<Cone> cones_;
    std::int32_t n_, m_;
    MatrixAssembler rates_, H_, halves_, D_;
    std::vector<DiagonalBlock3> blocks_;
    Kept kept_;
    Vector load_;
    Vector root_, row_scale_;  // √H_ii, and 1/√(D H_ii⁻¹ Dᵀ)_jj
};

/// The options of Newton's method for the table of a method; a method's own follow them.
std::vector<OptionInfo> newton_options(std::vector<OptionInfo> own = {});
/// Their values, the first ones of the table's.
NewtonSettings newton_settings(std::string method, const std::vector<OptionValue>& values);
/// How many values these are.
constexpr std::size_t newton_option_count = 5;

/// The row of the option `jacobian`.
OptionInfo jacobian_option(std::string default_value, std::vector<std::string> choices = {"symmetric", "exact"});

}  // namespace delassus
