// SPDX-License-Identifier: BSD-3-Clause
// The linear system of an interior point step, in the bases U of the cones (plugins/ipm/complementarity.hpp):
//
//     H δx − D̂ᵀ U δz               = f        D̂ = P D,  Ê = P E P
//     Uᵀ D̂ δx + (Uᵀ Ê U + θ) δz    = g
//
// by elimination of δz = T (g − Uᵀ D̂ δx), T = (Uᵀ Ê U + θ + δ)⁻¹ by cones:
//
//     (H + D̂ᵀ U T Uᵀ D̂) δx = f + D̂ᵀ U T g,
//
// a symmetric positive definite matrix over the bodies, MPIAIJ, scaled by R = |diag H|^(−½) on both sides. Solves are
// refined with the residual of the system as it stands.
#pragma once

#include "complementarity.hpp"
#include "petsc/part_system.hpp"

namespace delassus::petsc {

using ipm::Complementarity;
using ipm::Triple;

class CondensedSystem {
public:
    /// regularization: δ, relative to the diagonal of N. refinements: at most so many a solve.
    CondensedSystem(std::string preconditioner, Schwarz schwarz, double regularization, int refinements,
                    std::int64_t most_inner)
        : wanted_(std::move(preconditioner)),
          schwarz_(schwarz),
          regularization_(regularization),
          refinements_(refinements),
          most_inner_(most_inner) {}

    /// Collective, as all that follows.
    void analyze(const PartSystem& system, const sdk::LocalProblemView& problem);
    /// scale: the diagonal of P, m.
    void load(const PartSystem& system, const sdk::LocalProblemView& problem, const sdk::Vector& scale);
    /// theta: m, in the bases. Raises δ until the matrix can be factored. Throws sdk::NumericalFailure.
    void factorize(const sdk::LocalProblemView& problem, const Complementarity& cones, const sdk::Vector& theta);
    /// Where a solve starts from: zero, or the δx and δz that are there.
    enum class Start { Zero, Given };
    /// From f (own n) and g (own m, in the bases) δx and δz (in the bases), to a relative residual of `enough` if it
    /// can be had; the residual that was.
    double solve(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g, double enough, Start start,
                 sdk::Vector& dx, sdk::Vector& dz);
    [[nodiscard]] bool is_direct() const { return kind_ == LinearSolver::Mumps; }

    [[nodiscard]] const sdk::Vector& R() const { return R_; }
    [[nodiscard]] sdk::Vector apply_E(const sdk::Vector& z) const;  ///< Ê z
    [[nodiscard]] std::int64_t factorizations() const { return factorizations_; }
    [[nodiscard]] std::int64_t analyses() const { return analyses_; }
    [[nodiscard]] std::int64_t inner_iterations() const { return inner_iterations_; }
    /// For a message.
    [[nodiscard]] std::string description() const;

private:
    void find_T(const Complementarity& cones, const sdk::Vector& theta);
    void apply_T(sdk::Vector& v) const;
    void solve_once(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g, double enough,
                    sdk::Vector& dx, sdk::Vector& dz);
    /// f_rest_ and g_rest_ of δx and δz.
    void find_rest(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g, const sdk::Vector& dx,
                   const sdk::Vector& dz);

    std::string wanted_;
    Schwarz schwarz_;
    double regularization_;
    int refinements_;
    std::int64_t most_inner_;
    const PartSystem* system_ = nullptr;
    LinearSolver kind_ = LinearSolver::Mumps;
    std::vector<std::int32_t> groups_;  // their rows
    MatrixHandle matrix_;
    KrylovHandle krylov_;
    double delta_ = 0.0;
    sdk::Vector scale_, R_, theta_;
    std::vector<Triple> t_;  // rows of T, three a group
    sdk::Vector f_rest_, g_rest_, correction_x_, correction_z_;
    std::int64_t factorizations_ = 0, analyses_ = 0, inner_iterations_ = 0;
};

}  // namespace delassus::petsc
