// SPDX-License-Identifier: BSD-3-Clause
// The matrix that preconditions the Schur complement −N of K, assembled.
#pragma once

#include "delassus/sdk/problem_view.hpp"
#include "system.hpp"

namespace delassus::petsc {

/// −(D B Dᵀ + E + σ I), scaled as K is, with B = H⁻¹ where H is diagonal or has small blocks, else B = |diag H|⁻¹.
/// The pattern depends on the patterns of H, D and E alone. σ keeps it regular where rows of D are redundant.
class SchurMatrix {
public:
    explicit SchurMatrix(const sdk::MpiCommunicator& communicator) : communicator_(communicator) {}

    /// blocks: use H⁻¹ of the diagonal blocks; they must be definite.
    void analyze(const sdk::ProblemView& problem, const Layout& layout, bool blocks);
    void factorize(const sdk::ProblemView& problem, const Layout& layout, const sdk::Vector& C, double shift);
    [[nodiscard]] Mat get() const { return matrix_.get(); }

private:
    [[nodiscard]] sdk::SparseRows inverse(const sdk::ProblemView& problem) const;
    [[nodiscard]] sdk::SparseRows formed(const sdk::ProblemView& problem, const sdk::SparseRows& B) const;

    const sdk::MpiCommunicator& communicator_;
    bool blocks_ = false;
    MatrixHandle matrix_;
};

}  // namespace delassus::petsc
