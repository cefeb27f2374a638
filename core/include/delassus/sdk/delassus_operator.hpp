// SPDX-License-Identifier: BSD-3-Clause
// The Delassus operator N = D H⁻¹ Dᵀ + E (seed, eq. 116), never formed unless asked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "delassus/sdk/h_inverse.hpp"

namespace delassus::sdk {

/// Products with N, its diagonal blocks, r = D H⁻¹ a + b, and the velocities that go with given reactions.
/// analyze, factorize and the rest are called with the same problem (new a and b are fine).
class DelassusOperator {
public:
    void analyze(const ProblemView& problem) { inverse_.analyze(problem); }

    /// Factors H and computes the diagonal blocks of N. Throws NumericalFailure if H is not positive definite.
    /// will_form: formed() will be called, and N may be made in the same pass over D.
    void factorize(const ProblemView& problem, bool will_form = false, const Team& team = {});

    /// As factorize, where the values of H are those of the last factorisation: only D and E are new.
    void refresh(const ProblemView& problem, const Team& team = {}) { compute_blocks(problem, false, team); }

    /// result ← N λ; both m.
    void apply(const ProblemView& problem, const Vector& lambda, Vector& result) const;

    /// r = D H⁻¹ a + b: the constraint velocities without reactions; m.
    [[nodiscard]] Vector free_velocity(const ProblemView& problem) const;
    /// The same into r, which is resized.
    void free_velocity(const ProblemView& problem, Vector& r) const;

    /// x = H⁻¹ (a + Dᵀ λ); n.
    [[nodiscard]] Vector velocity(const ProblemView& problem, const Eigen::Ref<const Vector>& lambda) const;
    /// The same into x, which is resized.
    void velocity(const ProblemView& problem, const Eigen::Ref<const Vector>& lambda, Vector& x) const;

    /// The diagonal of N; m.
    [[nodiscard]] const Vector& diagonal() const { return diagonal_; }

    /// N_cc of a block of at most `largest_block` rows, row-major = column-major; null for larger blocks.
    [[nodiscard]] const double* block(std::size_t cone) const {
        return block_offset_[cone] < 0 ? nullptr : blocks_.data() + block_offset_[cone];
    }
    static constexpr int largest_block = 8;

    /// N as a sparse matrix. Costs memory of its fill: dense where H couples everything.
    [[nodiscard]] SparseRows formed(const ProblemView& problem) const;

    [[nodiscard]] const HInverse& inverse() const { return inverse_; }

    /// W = D L⁻ᵀ with H = L Lᵀ, so that N = W Wᵀ + E, where H is diagonal or of blocks.
    [[nodiscard]] const CompressedRows& whitened() const { return whitened_; }

private:
    /// Rows up to which N of a sparse H is made beside its blocks, as a dense matrix at first.
    static constexpr Eigen::Index most_rows_formed = 4000;

    void compute_blocks(const ProblemView& problem, bool will_form, const Team& team);

    void add_inertia_by_panels(const ProblemView& problem, bool will_form);

    void add_inertia(const ProblemView& problem, const Team& team);

    void add_compliance(const ProblemView& problem);

    HInverse inverse_;
    SparseRows inertia_;  // D H⁻¹ Dᵀ, where it was made with the blocks
    CompressedRows whitened_;
    Vector diagonal_;
    std::vector<double> blocks_;
    std::vector<std::ptrdiff_t> block_offset_;
    mutable Vector work_;
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/delassus_operator_bodies.hpp"
#endif
