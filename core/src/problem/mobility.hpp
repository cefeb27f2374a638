// SPDX-License-Identifier: BSD-3-Clause
// What the host itself asks of a definite H.
#pragma once

#include "delassus/sdk/h_inverse.hpp"

namespace delassus {

/// The diagonal of N = D H⁻¹ Dᵀ + E and the velocities that go with given reactions. All calls with the same problem;
/// new a and b are fine. Unlike sdk::DelassusOperator it makes no blocks of N.
class Mobility {
public:
    /// Reads the structure of H; throws std::invalid_argument unless it is definite or n = 0.
    void analyze(const sdk::ProblemView& problem) { inverse_.analyze(problem); }
    /// Throws NumericalFailure if H is not positive definite.
    void factorize(const sdk::ProblemView& problem);
    /// Says that D and E are new, while the values of H are those of the last factorisation.
    void refresh() { diagonal_is_known_ = false; }

    [[nodiscard]] const sdk::HInverse& inverse() const { return inverse_; }
    /// r ← D H⁻¹ a + b, resized to m; the diagonal of N, m, valid until the next call.
    const sdk::Vector& free_velocity(const sdk::ProblemView& problem, sdk::Vector& r);
    /// x ← H⁻¹ (a + Dᵀ λ); resized to n. λ: m, or none for λ = 0.
    void velocity(const sdk::ProblemView& problem, const double* lambda, sdk::Vector& x) const;

private:
    void find_diagonal(const sdk::ProblemView& problem);

    sdk::HInverse inverse_;
    sdk::Vector inverse_diagonal_;  // of H, where H is diagonal
    sdk::Vector diagonal_, work_;
    bool diagonal_is_known_ = false;
};

}  // namespace delassus
