// SPDX-License-Identifier: BSD-3-Clause
// The affine half of the splitting: one linear system with a cached Cholesky factor.
#pragma once

#include <memory>

#include "cholesky.hpp"
#include "delassus/sdk/block_rows.hpp"
#include "factor.hpp"
#include "row_scaling.hpp"

namespace delassus::admm {

/// Solves  μ̂ + ρ (N̂ μ̂ + r̂) = ŵ  for μ̂: the reactions μ̂ and velocities û = (ŵ − μ̂)/ρ that obey the equations of
/// motion and lie on the line μ̂ + ρ û = ŵ. With x it reads
///
///     H x − D̂ᵀ μ̂ = a,      D̂ x + (Ê + 1/ρ) μ̂ = ŵ/ρ − b̂,
///
/// a quasi-definite system, from which one unknown is eliminated:
///
/// - primal: μ̂ = V (ŵ/ρ − b̂ − D̂ x) with V = (Ê + 1/ρ)⁻¹, hence (H + D̂ᵀ V D̂) x = a + D̂ᵀ V (ŵ/ρ − b̂). V is ρ without
///   compliance, diagonal with a diagonal E, and a factor of its own otherwise. The matrix has the pattern of touching
///   bodies whatever the number of contacts, and no rank of D is asked for. H may be singular where D holds it.
/// - dual: (N̂ + 1/ρ) μ̂ = ŵ/ρ − r̂, for n = 0 and for few rows on a sparse H.
class Resolvent {
public:
    enum class Form { Automatic, Primal, Dual };

    explicit Resolvent(Form form) : wanted_(form) {}

    void analyze() { pattern_is_new_ = true; }
    /// Takes new values of H, D and E; set_penalty has to follow.
    void load_matrices(const sdk::ProblemView& problem, const RowScaling& scaling);
    /// Factors for this ρ, unless it has it. Throws sdk::NumericalFailure if the matrix is not definite.
    void set_penalty(double penalty);
    /// Takes new a and b. r: r = D H⁻¹ a + b, in the problem's units; m, used by the dual form.
    void load(const sdk::ProblemView& problem, const sdk::Vector& r);
    /// μ̂ ← the solution for ŵ, û ← (ŵ − μ̂)/ρ; all m, all different.
    void apply(const sdk::Vector& w, sdk::Vector& mu, sdk::Vector& u);

    /// x of the latest apply; n, primal form only.
    [[nodiscard]] const sdk::Vector& x() const { return x_; }
    [[nodiscard]] double penalty() const { return penalty_; }
    [[nodiscard]] bool primal() const { return form_ == Form::Primal; }
    [[nodiscard]] std::int64_t analyses() const { return analyses_; }
    [[nodiscard]] std::int64_t factorizations() const { return factorizations_; }

private:
    void choose_form(const sdk::ProblemView& problem, const RowScaling& scaling);
    [[nodiscard]] sdk::SparseColumns primal_matrix(double penalty);
    [[nodiscard]] sdk::SparseColumns dual_matrix(double penalty) const;
    void apply_V(sdk::Vector& v) const;

    Form wanted_, form_ = Form::Primal;
    bool pattern_is_new_ = true;
    double penalty_ = 0.0;
    sdk::Vector scale_, a_, b_;  // P, a, and b̂ (primal) or r̂ (dual)
    sdk::SparseColumns H_, D_;   // H and D̂; primal only
    sdk::SparseColumns square_;  // primal without compliance: D̂ᵀD̂; dual: N̂ with its whole diagonal
    sdk::SparseColumns E_;       // Ê with its whole diagonal, if it is not diagonal; primal only
    bool diagonal_compliance_ = true;
    sdk::Vector compliance_, V_;  // the diagonals of Ê and of V, if Ê is diagonal; primal only
    sdk::BlockRows rows_;         // D̂; primal only
    sdk::Vector x_, work_;
    sdk::Vector padded_;  // x with the padding of BlockRows
    Factor factor_;
    std::unique_ptr<delassus_cholmod::Cholesky> compliance_factor_;
    std::int64_t analyses_ = 0, factorizations_ = 0;
};

}  // namespace delassus::admm
