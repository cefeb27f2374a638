// SPDX-License-Identifier: BSD-3-Clause
// The error measures from parts, by reductions: what ErrorMeter is to a whole problem. Everything is collective.
#pragma once

#include <vector>

#include "partitioned/prepared_part.hpp"
#include "problem/cone_sums.hpp"
#include "solver/judgement.hpp"

namespace delassus {

class PartMeter {
public:
    /// Computes r = D H⁻¹a + b and the diagonal of N.
    explicit PartMeter(const PreparedPart::Implementation& part);

    /// The right-hand side is new.
    void renew();

    [[nodiscard]] Errors measure(const double* x, const double* lambda);
    [[nodiscard]] double natural(const double* x, const double* lambda);
    [[nodiscard]] double reference() const { return reference_; }
    /// ‖S D v‖ of the own part v.
    [[nodiscard]] double norm_in_rows(const double* v);
    [[nodiscard]] RoundingOfBalance rounding_of_balance(const double* x, const double* lambda);

private:
    [[nodiscard]] std::vector<double> diagonal_of_N() const;
    void add_squares_of_rows(std::vector<double>& diagonal) const;
    void add_squares_by_solves(std::vector<double>& diagonal) const;
    void take_x(const double* x);
    void take_lambda(const double* lambda);
    /// Own sums over the cones at the x and λ taken; leaves the own part of Dᵀλ in impulse_ if asked.
    [[nodiscard]] ConeSums sums_over_cones(const double* lambda, bool with_impulse);

    const PreparedPart::Implementation& part_;
    std::vector<double> scaling_;  ///< one a cone
    /// |diag H|, n, where it stands in for H; empty otherwise.
    std::vector<double> magnitude_;
    double reference_ = 1.0, r_norm_ = 0.0;
    std::vector<double> x_, lambda_, impulse_;  ///< local vectors: own entries, then ghosts
    std::vector<double> work_;                  ///< three times the rows of the largest cone
};

}  // namespace delassus
