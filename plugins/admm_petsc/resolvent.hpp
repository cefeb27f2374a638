// SPDX-License-Identifier: BSD-3-Clause
// The affine half of the splitting on the processes of a partitioned problem: the primal form of
// plugins/admm/resolvent.hpp, on Cholesky factors by MUMPS.
#pragma once

#include "petsc/part_system.hpp"

namespace delassus::petsc {

/// Solves  μ̂ + ρ (N̂ μ̂ + r̂) = ŵ  for μ̂ by  (H + D̂ᵀ V D̂) x = a + D̂ᵀ V (ŵ/ρ − b̂),  μ̂ = V (ŵ/ρ − b̂ − D̂ x),
/// V = (Ê + 1/ρ)⁻¹, which is blocks of contacts. All operations are collective.
class Resolvent {
public:
    void analyze(const PartSystem& system, const sdk::LocalProblemView& problem);
    /// New values of the matrices; set_penalty has to follow. scale: the diagonal of P, m.
    void load_matrices(const sdk::Vector& scale);
    /// Factors for this ρ, unless it has it. Throws sdk::NumericalFailure if the matrix is not definite.
    void set_penalty(const sdk::LocalProblemView& problem, double penalty);
    void load(const sdk::LocalProblemView& problem);
    /// μ̂ ← the solution for ŵ, û ← (ŵ − μ̂)/ρ; own rows.
    void apply(const sdk::Vector& w, sdk::Vector& mu, sdk::Vector& u);

    [[nodiscard]] double penalty() const { return penalty_; }
    [[nodiscard]] std::int64_t analyses() const { return analyses_; }
    [[nodiscard]] std::int64_t factorizations() const { return factorizations_; }

private:
    void find_V();
    void apply_V(sdk::Vector& v) const;

    const PartSystem* system_ = nullptr;
    std::vector<std::int32_t> groups_;
    MatrixHandle matrix_;
    KrylovHandle krylov_;
    double penalty_ = 0.0;
    sdk::Vector scale_, a_, b_;
    sdk::Vector diagonal_V_;                 // where Ê is diagonal
    std::vector<Eigen::Matrix3d> blocks_V_;  // of the groups, where it is not
    std::int64_t analyses_ = 0, factorizations_ = 0;
};

}  // namespace delassus::petsc
