// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/relaxation.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "support/pivoted_qr.hpp"

namespace delassus {

// ---- The method ----
//
// Sought are q and λ with f(q) + C_qᵀ λ = 0 and C(q) = 0. Newton's method alone meets singular matrices (a chain that
// is stretched straight has no stiffness across), and ends in any equilibrium, stable or not. So the way there is a
// sequence of steps of implicit Euler that begin at rest: from q_k to q_{k+1} = q_k ∘ exp(Δ) with
//
//     M Δ/τ² − f(q_{k+1}) − C_qᵀ λ = 0,      C(q_{k+1}) = 0
//
// Where f = −∇V, this is the stationarity of V(q_{k+1}) + ‖Δ‖²_M/(2 τ²), a step of the proximal-point method
// (Rockafellar, SIAM J. Control Optim. 14, 1976): V descends, and with growing τ the sequence converges faster than
// linearly; a vibration of frequency ω shrinks by 1/(1 + ω² τ²) in a step. τ is up to ten times longer after each step,
// so that near the end these are Newton steps with K alone. (Pseudo-transient continuation, Kelley and Keyes, SIAM J.
// Numer. Anal. 35, 1998.) A step in which Newton's method fails, or which the forces do not drive,
//
//     ½ (f(q_k) + f(q_{k+1})) · Δ < 0
//
// goes uphill and is tried again with a shorter τ. So an equilibrium is stable as a rule; one from which nothing moves
// may be unstable, which the eigenvalues tell.

Relaxation::Relaxation(DynamicalSystem& system, RelaxationSettings settings)
    : system_(system),
      settings_(settings),
      newton_(system, {.method = "the search for an equilibrium",
                       .jacobian = Jacobian::Symmetric,
                       .max_iterations = 25,
                       .watchdog = true}),
      n_(system.n()),
      m_(system.m()) {}

double Relaxation::mass_norm(const Vector& x, const State& state) const {
    Vector Mx = Vector::Zero(n_);
    system_.multiply_mass(state, 1.0, x.data(), Mx.data());
    return std::sqrt(std::max(0.0, x.dot(Mx)));
}

namespace {

double largest_of(const std::vector<double>& q) {
    double value = 0.0;
    for (const double x : q) value = std::max(value, std::abs(x));
    return value;
}

constexpr double longest_tau = 1e8, shortest_tau = 1e-9;  // s

}  // namespace

RelaxationReport Relaxation::run(State& state, Vector& lambda, StepSolver& solver) {
    RelaxationReport report;
    const State start = state;
    const auto at_rest = [&](const State& where, const Vector& reactions) {
        return StepPoint{where, Vector::Zero(n_), Vector::Zero(n_), reactions};
    };
    StepPoint now = at_rest(state, lambda);
    StepResidual residual;
    if (!newton_.evaluate(state, now, residual)) throw StepFailure("the forces are not finite where the search begins");
    const double farthest = settings_.farthest * (1.0 + largest_of(start.q));
    const double digits = 1e-13 * (1.0 + largest_of(start.q)) * mass_norm(Vector::Ones(n_), state);
    double last_move = std::numeric_limits<double>::infinity(), last_tau = 0.0;
    int stalled = 0;
    int failures = 0;
    double growth = 10.0;
    std::string failure;
    const auto failed = [&](const char* why) {
        failure = why;
        ++failures;
        tau_ *= 0.1;
        growth = 2.0;
    };
    tau_ = std::clamp(tau_, 1e-3, 1e3);
    for (int step = 0; step < settings_.most_steps; ++step) {
        if (tau_ < shortest_tau || failures > settings_.most_failures) break;
        const StepSlopes slopes{0.0, 1.0 / (tau_ * tau_)};
        StepPoint next = at_rest(now.state, now.lambda);
        StepResidual next_residual;
        newton_.evaluate(now.state, next, next_residual);
        const Vector force_before = next_residual.force;
        StepReport effort;
        ++report.steps;
        try {
            newton_.solve(now.state, tau_, slopes, next, next_residual, solver, effort);
        } catch (const StepFailure&) {
            failed("Newton's method did not converge");
            report.newton_iterations += effort.newton_iterations;
            continue;
        }
        report.newton_iterations += effort.newton_iterations;
        const double work = 0.5 * (force_before + next_residual.force).dot(next.delta);
        const double size = (force_before.norm() + next_residual.force.norm()) * next.delta.norm();
        const double move = mass_norm(next.delta, next.state);
        if (work < -1e-6 * size && move > digits && tau_ > 1e-6) {
            failed("the way leads uphill");
            continue;
        }
        now = at_rest(next.state, next.lambda);
        if (largest_of(now.state.q) > farthest)
            throw StepFailure(
                "no equilibrium was found: something moves away without bound; it should be held by joints, springs or "
                "elements, or carry no load");
        Vector way(n_);
        system_.difference(start.q.data(), now.state.q.data(), way.data());
        const double far = mass_norm(way, now.state), threshold = settings_.tolerance * far + digits;
        // Or to rounding: with longer and longer τ it moves by as little as before.
        const bool longer = tau_ >= last_tau, little = move <= 1e-7 * far && move > 0.1 * last_move;
        stalled = longer && little ? stalled + 1 : 0;
        const bool settled =
            longer && ((move <= threshold && (last_move <= 1e3 * threshold || move <= digits)) || stalled >= 3);
        last_move = move;
        last_tau = tau_;
        tau_ = std::min(growth * tau_, longest_tau);
        growth = std::min(1.5 * growth, 10.0);
        if (!settled) continue;
        newton_.evaluate(now.state, now, residual);
        report.residual = largest_entry(residual.balance);
        report.reaction = largest_entry(residual.reaction);
        state = now.state;
        lambda = now.lambda;
        return report;
    }
    throw StepFailure(fmt::format(
        "no equilibrium was found in {} steps of the search{}{}; smaller load steps may help, if there is one",
        report.steps, failure.empty() ? "" : ": ", failure));
}

double Relaxation::smallest_eigenvalue(const State& state, const Vector& lambda) const {
    constexpr std::int32_t most = 600;
    if (n_ == 0 || n_ > most) return std::numeric_limits<double>::quiet_NaN();
    const auto dense = [](const SparseMatrix& A) {
        Eigen::MatrixXd full = Eigen::MatrixXd::Zero(A.rows, A.columns);
        for (std::int32_t row = 0; row < A.rows; ++row)
            for (auto e = A.row_start[static_cast<std::size_t>(row)];
                 e < A.row_start[static_cast<std::size_t>(row) + 1]; ++e)
                full(row, A.column[static_cast<std::size_t>(e)]) += A.value[static_cast<std::size_t>(e)];
        return full;
    };
    MatrixAssembler assembler;
    assembler.begin(n_, n_);
    system_.add_mass(state, 1.0, assembler);
    const Eigen::MatrixXd M = dense(assembler.finish());
    assembler.begin(n_, n_);
    if (system_.has_stiffness()) system_.add_stiffness(state, 1.0, Tangent::Symmetric, assembler);
    if (m_ > 0) system_.add_constraint_stiffness(state, lambda.data(), -1.0, Tangent::Symmetric, assembler);
    const Eigen::MatrixXd K = dense(assembler.finish());
    Eigen::MatrixXd Z = Eigen::MatrixXd::Identity(n_, n_);
    if (m_ > 0) {
        assembler.begin(m_, n_);
        system_.add_constraint_jacobian(state, 0, assembler);
        const PivotedQr qr(dense(assembler.finish()).transpose());
        Z = qr.Q().rightCols(n_ - qr.rank(1e-10));
    }
    if (Z.cols() == 0) return std::numeric_limits<double>::quiet_NaN();
    const Eigen::MatrixXd ZKZ = Z.transpose() * K * Z, ZMZ = Z.transpose() * M * Z;
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> modes(ZKZ, ZMZ, Eigen::EigenvaluesOnly);
    if (modes.info() != Eigen::Success) return std::numeric_limits<double>::quiet_NaN();
    const double value = modes.eigenvalues()[0];
    // What rounding of the largest makes of zero.
    const double rounding =
        10.0 * std::numeric_limits<double>::epsilon() * n_ * modes.eigenvalues().cwiseAbs().maxCoeff();
    return std::abs(value) <= rounding ? 0.0 : value;
}

}  // namespace delassus
