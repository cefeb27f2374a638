// SPDX-License-Identifier: BSD-3-Clause
// A part of a problem as a problem of its own, by mass splitting (Tonge, Benevolenski and Voroshilov 2012).
//
// A body that rows of k processes touch has k copies, one in each, with the share H/k of its block of H = L Lᵀ and a/k
// of its a. D_p are the rows of process p, and v its velocity from all reactions together:
//
//     v = H⁻¹(a + Σ_p D_pᵀ λ_p) = (1/k) Σ_p v_p,        v_p = (H/k)⁻¹ (a/k + D_pᵀ λ_p).
//
// So the mean of the copies' velocities is the body's own, whatever the λ_p. Every process sweeps its rows on the
// velocities of its copies, which start from v, and after a sweep the copies take their mean: one exchange.
//
// Why it converges. Let δ_p be what the sweep of process p changes. At the body the objective φ(λ) = ½λᵀNλ + rᵀλ has
//
//     ½ ‖L⁻¹ Σ_p D_pᵀ δ_p‖² ≤ ½ Σ_p k ‖L⁻¹ D_pᵀ δ_p‖²        (Cauchy–Schwarz),
//
// the right side of which is what the copies, with H/k, have for their processes alone. The problem of the copies thus
// bounds φ from above with equality at δ = 0, and it has no term that couples processes. A sweep of Gauss–Seidel lowers
// each process's share of it, so that φ falls by at least as much: block Jacobi over the processes, on a bound of N,
// which under the associated law converges as Gauss–Seidel does. Only rows that touch shared bodies make shorter steps,
// by 1/k at most.
//
// In whitened velocities a copy has v̂_p = (L/√k)ᵀ v_p = Lᵀ v_p/√k. All copies have the same factor, so that their mean
// is taken entry by entry of v̂. After it the squares of k copies add up to that of the body, ‖Lᵀ v‖², and so the
// objectives of the processes' problems add up to φ, and a constant of bodies that own rows do not touch.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "model.hpp"
#include "other_parts.hpp"
#include "petsc/bodies.hpp"

namespace delassus::petsc {

class SplitPart : public pgs::OtherParts {
public:
    /// Collective. Throws std::runtime_error, on all processes, where E is not diagonal and nonnegative, or there are
    /// too many rows.
    void analyze(const Processes& processes, const sdk::LocalProblemView& problem);
    /// Fetches H. Collective.
    void factorize(const sdk::LocalProblemView& problem);
    /// Takes a, b and the cones' parameters. Collective.
    void load(const sdk::LocalProblemView& problem);

    /// Own rows, and the columns that they touch or the process owns, in the order of Bodies::columns(). H and a are
    /// shares. Complete after load(), as long as the problem that was loaded; before it a and b are zero.
    [[nodiscard]] const sdk::ProblemView& problem() const { return *view_; }

    /// The diagonal of N from that of the split problem: rows that touch shared bodies have more there.
    [[nodiscard]] sdk::Vector diagonal(const sdk::DelassusOperator& split) const;

    /// x = H⁻¹(a + Dᵀλ) at all columns of problem(). Collective.
    [[nodiscard]] sdk::Vector velocity(const sdk::DelassusOperator& split, const sdk::Vector& lambda) const;
    /// The own columns among those of problem().
    [[nodiscard]] auto own(const sdk::Vector& v) const { return v.segment(columns().first_own(), columns().own()); }

    /// Finds the shared columns in the states of a model of problem().
    void find_places(const pgs::Model& model);

    [[nodiscard]] const Processes& processes() const { return bodies_.processes(); }
    /// Sent by all processes together in one sweep.
    [[nodiscard]] std::int64_t bytes_a_sweep() const { return 2 * columns().bytes(); }

    [[nodiscard]] bool exist() const override { return processes().size() > 1; }
    void sum(std::span<double> values) const override { processes().sum(values); }
    void reconcile(std::span<double> state) const override;

private:
    struct Shared {
        std::int32_t column;
        double share;  // 1/k
    };

    [[nodiscard]] const Exchange& columns() const { return bodies_.columns(); }
    void check_compliance(const sdk::LocalProblemView& problem) const;
    void find_shares();
    void make_view(const sdk::LocalProblemView& problem);

    Bodies bodies_;
    sdk::Vector share_;                      // 1/k of every column
    std::vector<Shared> shared_;             // touched by own rows and by others'
    std::vector<std::int32_t> elsewhere_;    // own columns that rows of others alone touch
    std::vector<std::int32_t> shared_rows_;  // that touch shared columns
    std::vector<std::size_t> place_;         // of shared_, in a state
    mutable sdk::Vector scratch_;            // columns

    LocalRows rows_;
    std::span<const std::int32_t> D_start_, D_column_;  // in rows_
    std::vector<std::int32_t> E_start_, E_column_, block_start_, block_index_;
    std::vector<double> E_value_;
    sdk::CompressedRows H_;
    sdk::Vector a_;
    delassus_problem raw_{};
    std::unique_ptr<sdk::ProblemView> view_;
};

}  // namespace delassus::petsc
