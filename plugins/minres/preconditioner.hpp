// SPDX-License-Identifier: BSD-3-Clause
// The block preconditioner diag(Ĥ⁻¹, Ŝ⁻¹) of the saddle-point matrix.
#pragma once

#include <Eigen/IterativeLinearSolvers>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "delassus/sdk/delassus_operator.hpp"

namespace delassus_minres {

using delassus::sdk::ProblemView;
using delassus::sdk::Vector;

enum class Schur { Automatic, Diagonal, Blocks, IncompleteCholesky, Identity };

/// Symmetric positive definite. Ĥ = H where H is definite, else |diag H| with the mean of the others for a zero entry.
/// Ŝ ≈ N = D Ĥ⁻¹ Dᵀ + E. With the exact H and N, K preconditioned has three eigenvalues only, 1 and ½ ± √5/2, and
/// MINRES ends after three steps (Murphy, Golub, Wathen 2000); with an approximate Ŝ the steps follow the spread of
/// Ŝ⁻¹N.
class Preconditioner {
public:
    explicit Preconditioner(Schur choice) : choice_(choice) {}

    void analyze(const ProblemView& problem);
    /// Throws delassus::sdk::NumericalFailure.
    void factorize(const ProblemView& problem);

    /// v ← Ĥ⁻¹ v; n.
    void apply_mass(Vector& v) const;
    /// v ← Ŝ⁻¹ v; m.
    void apply_schur(Vector& v) const;

    /// The diagonal of N; m.
    [[nodiscard]] const Vector& diagonal() const { return diagonal_; }
    /// Whether Ĥ = H.
    [[nodiscard]] bool exact_mass() const { return definite_; }
    [[nodiscard]] std::int64_t analyses() const { return analyses_; }
    [[nodiscard]] std::int64_t factorizations() const { return factorizations_; }
    /// What Ŝ is, for a message.
    [[nodiscard]] std::string description() const;

private:
    void stand_in(const ProblemView& problem);
    [[nodiscard]] double products_in_N(const ProblemView& problem) const;
    [[nodiscard]] delassus::sdk::SparseRows formed_N(const ProblemView& problem) const;
    void factorize_blocks(const ProblemView& problem);
    [[nodiscard]] bool factorize_incomplete(const ProblemView& problem);

    Schur choice_;
    Schur used_ = Schur::Diagonal;
    bool definite_ = true;
    delassus::sdk::DelassusOperator N_;
    Vector mass_inverse_;  // n, of |diag H|; where H is not definite
    Vector diagonal_, diagonal_inverse_;
    struct Block {
        Eigen::Index first = 0;
        Eigen::MatrixXd inverse;
    };
    std::vector<Block> blocks_;
    using IncompleteCholesky = Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::AMDOrdering<std::int32_t>>;
    std::unique_ptr<IncompleteCholesky> incomplete_;
    std::int64_t analyses_ = 0, factorizations_ = 0;
};

}  // namespace delassus_minres
