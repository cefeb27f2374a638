// SPDX-License-Identifier: BSD-3-Clause
// Solves with a definite H, and the diagonal of N, for the host itself.
#pragma once

#include <span>

#include "delassus/sdk/delassus_operator.hpp"

namespace delassus {

/// The diagonal of N = D H⁻¹ Dᵀ + E and the velocities that go with given reactions. All calls are for the same
/// problem, of which a and b may change. For a diagonal H no blocks of N are formed; any other H is left to
/// sdk::DelassusOperator.
class Mobility {
public:
    /// Reads the structure of H; throws std::invalid_argument unless it is definite or n = 0.
    void analyze(const sdk::ProblemView& problem);
    /// Throws NumericalFailure if H is not positive definite.
    void factorize(const sdk::ProblemView& problem, const sdk::Team& team);
    /// Announces new D and E. The values of H must be those of the last factorisation.
    void refresh() { rows_are_new_ = true; }

    [[nodiscard]] const sdk::HInverse& inverse() const { return H_is_diagonal_ ? inverse_ : operator_.inverse(); }
    /// r ← D H⁻¹ a + b, resized to m; the diagonal of N, m, valid until the next call. shares_columns: of cones,
    /// whether all their rows have entries in the same columns of D.
    const sdk::Vector& free_velocity(const sdk::ProblemView& problem, std::span<const char> shares_columns,
                                     const sdk::Team& team, sdk::Vector& r);
    /// x ← H⁻¹ (a + Dᵀ λ); resized to n. λ: m, or none for λ = 0.
    void velocity(const sdk::ProblemView& problem, const double* lambda, sdk::Vector& x) const;

private:
    bool H_is_diagonal_ = false;
    sdk::DelassusOperator operator_;  // unless H is diagonal
    sdk::HInverse inverse_;           // if it is
    sdk::Vector inverse_diagonal_, diagonal_, work_;
    bool rows_are_new_ = false;  // since the diagonal was made
};

}  // namespace delassus
