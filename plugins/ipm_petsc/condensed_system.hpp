// SPDX-License-Identifier: BSD-3-Clause
// The linear system of an interior point step, in the bases U of the cones (plugins/ipm/complementarity.hpp):
//
//     Ĥ δx − D̂ᵀ U δz               = f        in the scaled variables of plugins/ipm/scaled_system.hpp
//     Uᵀ D̂ δx + (Uᵀ Ê U + θ) δz    = g
//
// by elimination of δz = T (g − Uᵀ D̂ δx), T = (Uᵀ Ê U + θ + δ)⁻¹ by cones:
//
//     (Ĥ + D̂ᵀ U T Uᵀ D̂) δx = f + D̂ᵀ U T g,
//
// a symmetric positive definite matrix over the bodies, MPIAIJ.
#pragma once

#include "petsc/part_system.hpp"
#include "refinement.hpp"

namespace delassus::petsc {

using ipm::Complementarity;
using ipm::Triple;

/// The cones of own rows; what a step decides by is of those of all processes.
class PartCones : public Complementarity {
public:
    /// rows: own ones. Collective, as all that follows but degree().
    void load(const sdk::ProblemView& rows, const sdk::Vector& z_scale, const Processes& processes) {
        Complementarity::load(rows, z_scale);
        processes_ = processes;
        degree_ = processes.sum(Complementarity::degree());
    }
    [[nodiscard]] double degree() const { return degree_; }
    [[nodiscard]] double mean_product(double step = 0.0) const {
        if (!(degree_ > 0.0)) return 0.0;
        return processes_.sum(Complementarity::mean_product(step) * Complementarity::degree()) / degree_;
    }
    [[nodiscard]] double longest_step() const { return processes_.min(Complementarity::longest_step()); }

private:
    Processes processes_;
    double degree_ = 0.0;
};

struct CondensedSettings {
    std::string preconditioner;
    Schwarz schwarz;
    double regularization = 0.0;  ///< δ, relative to the diagonal of N
    int refinements = 0;          ///< at most so many a solve
    std::int64_t most_inner = 0, correctors = 0;
};

/// What plugins/ipm/equations.hpp is in one process, for the associated law and a definite H. Collective.
class CondensedSystem : public PartSystem {
public:
    using View = sdk::LocalProblemView;
    using Cones = PartCones;
    using Linear = CondensedSystem;
    using Start = ipm::Refinement<CondensedSystem>::Start;

    // The predictor is a forecast only.
    static constexpr double predictor_residual = 1e-2, tightest_residual = 1e-10, start_residual = 1e-3;
    /// What a linear solve leaves stays in the equations after the step; it does no harm while it falls faster than the
    /// products do. With the mean product τ the corrector is solved to
    ///     rest ≤ 0.1 min(τ, √τ · (what is left of the equations))·√(number of products)
    /// relative to its right-hand side, between 1e-10 and 1e-3: the forcing sequence. (Bellavia 1998 has such a bound,
    /// in τ alone.)
    [[nodiscard]] static double corrector_residual(double tau, double degree, double equations);
    /// A factorisation costs as much as dozens of the solves that a corrector takes; with conjugate gradients solves
    /// are the cost.
    [[nodiscard]] std::int64_t correctors() const { return kind_ == LinearSolver::Mumps ? settings_.correctors : 0; }

    explicit CondensedSystem(CondensedSettings settings = {}) : settings_(std::move(settings)) {}

    void analyze(const sdk::LocalProblemView& problem);
    using PartSystem::factorize;
    /// problem must last as long as the solve.
    void load(const sdk::LocalProblemView& problem, PartCones& cones);

    [[nodiscard]] static bool definite() { return true; }
    [[nodiscard]] const sdk::Vector& a() const { return a_; }              ///< â
    [[nodiscard]] const sdk::Vector& b() const { return b_; }              ///< b̂
    [[nodiscard]] const sdk::Vector& x_scale() const { return x_scale_; }  ///< ρ R
    [[nodiscard]] const sdk::Vector& z_scale() const { return z_scale_; }  ///< ρ P
    [[nodiscard]] double rows() const { return static_cast<double>(problem_->raw->m_all); }

    /// x ← H⁻¹(a + Dᵀλ); the natural error.
    [[nodiscard]] double measure(sdk::Vector& x, const sdk::Vector& lambda) const {
        return measured(*problem_, lambda, x);
    }
    void find_residuals(const sdk::Vector& x, const PartCones& cones, sdk::Vector& f, sdk::Vector& g) const {
        f = a_ - times_H(x) + times_transposed_D(cones.z());
        g = cones.u() - b_ - times_D(x) - times_E(cones.z());
    }

    [[nodiscard]] sdk::Vector times_H(const sdk::Vector& x) const {
        return R_.cwiseProduct(apply_H(R_.cwiseProduct(x)));
    }
    [[nodiscard]] sdk::Vector times_D(const sdk::Vector& x) const {
        return p_.cwiseProduct(apply_D(R_.cwiseProduct(x)));
    }
    [[nodiscard]] sdk::Vector times_transposed_D(const sdk::Vector& z) const {
        return R_.cwiseProduct(apply_transpose(p_.cwiseProduct(z)));
    }
    [[nodiscard]] sdk::Vector times_E(const sdk::Vector& z) const;
    using PartSystem::norm;
    [[nodiscard]] double norm(const sdk::Vector& f, const sdk::Vector& g) const {
        return std::sqrt(processes().sum(f.squaredNorm() + g.squaredNorm()));
    }

    /// theta: m, in the bases. Raises δ until the matrix can be factored. Throws sdk::NumericalFailure.
    void factorize(const Complementarity& cones, const sdk::Vector& theta);
    void solve(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g, double enough, Start start,
               sdk::Vector& dx, sdk::Vector& dz) {
        refinement_.solve(*this, cones, f, g, enough, start, dx, dz);
    }

    // What Refinement takes; enough: the norm that the rest may have.
    void solve_once(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g, double enough,
                    sdk::Vector& dx, sdk::Vector& dz);
    void find_rest(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g, const sdk::Vector& dx,
                   const sdk::Vector& dz, sdk::Vector& f_rest, sdk::Vector& g_rest) const;
    [[nodiscard]] double weighted_norm(const sdk::Vector& f, const sdk::Vector& g) const;
    /// By rounding, the residual that conjugate gradients carry along is not the system's own: they start again.
    [[nodiscard]] int refinements() const {
        return kind_ == LinearSolver::Mumps ? settings_.refinements : 4 * settings_.refinements;
    }

    [[nodiscard]] sdk::PhaseClock::Span on_cones() const {
        return processes().meter()->span(DELASSUS_PHASE_PROJECTIONS);
    }
    [[nodiscard]] std::int64_t factorizations() const { return factorizations_; }
    [[nodiscard]] std::int64_t analyses() const { return analyses_; }
    /// For a message.
    [[nodiscard]] std::string description() const;

private:
    void find_T(const Complementarity& cones, const sdk::Vector& theta);
    void apply_T(sdk::Vector& v) const;

    CondensedSettings settings_;
    const sdk::LocalProblemView* problem_ = nullptr;
    LinearSolver kind_ = LinearSolver::Mumps;
    std::vector<std::int32_t> groups_;  // their rows
    MatrixHandle matrix_;
    KrylovHandle krylov_;
    ipm::Refinement<CondensedSystem> refinement_;
    double delta_ = 0.0;
    sdk::Vector p_, R_, x_scale_, z_scale_, a_, b_, theta_;
    std::vector<Triple> t_;  // rows of T, three a group
    std::int64_t factorizations_ = 0, analyses_ = 0, inner_iterations_ = 0;
};

}  // namespace delassus::petsc
