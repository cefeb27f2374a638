// SPDX-License-Identifier: BSD-3-Clause
// How far the motion of a step can take the values of rows (internal).
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "delassus/dynamical_system.hpp"
#include "delassus/problem.hpp"
#include "dynamics/row_entries.hpp"
#include "dynamics/velocity_contacts.hpp"

namespace delassus {

/// What a linear model misses of a constraint is a share of the way that its velocities have along the row,
/// h Σ |D_j| |v_j|. Where a motion begins, or turns, these are 0, and what acts moves the bodies across the row. A step
/// tells no motion from rest below that which forces alone give it, Δ = a/H − v; of each body that is along any row, by
/// Cauchy's inequality, at most
///
///     h |Σ D_j Δ_j| ≤ h √(Σ D_j²/H_jj) √(Σ H_jj Δ_j²)
///
/// nor below the 20 ε in the same norm that a solve may leave of velocities (dynamics/bodies_at_rest.hpp). All is in
/// the unit of the row, whatever those of the velocities are. Where a system does not say which velocities are of one
/// body, those of a row are. What a row measures is known to the last digits of the largest coordinate, and of an
/// angle; a row that holds nothing has no way.
class RowWays {
public:
    explicit RowWays(const DynamicalSystem& system) : body_(system.bodies_of_columns()) {
        const bool single = body_.empty() || *std::max_element(body_.begin(), body_.end()) + 1 == system.n();
        if (single) body_.assign(body_.size(), 0);
    }
    /// problem: that of the step, of velocities. left: StepAnswer::left_in_masses, or empty.
    void find(const Problem& problem, const State& begin, const State& end, std::span<const double> left) {
        constexpr double last_digits = 1e-9, left_at_most = 20.0;
        h_ = end.t - begin.t;
        digits_ = last_digits;
        for (const double q : begin.q) digits_ = std::max(digits_, last_digits * std::abs(q));
        diagonal_of(problem.H, mass_);
        speed_.resize(mass_.size());
        energy_.resize(mass_.size());
        for (std::size_t j = 0; j < mass_.size(); ++j) {
            speed_[j] = std::max(std::abs(begin.v[j]), std::abs(end.v[j]));
            energy_[j] = mass_[j] * std::pow(problem.a[j] / mass_[j] - begin.v[j], 2);
            if (!left.empty()) energy_[j] = std::max(energy_[j], std::pow(left_at_most * left[j], 2));
        }
    }
    /// What rounding makes of any row.
    [[nodiscard]] double digits() const { return digits_; }
    /// Of a row of D, whose columns are those of the problem.
    [[nodiscard]] double of(const SparseMatrix& D, std::size_t row) const {
        double speed = 0.0, mobility = 0.0, energy = 0.0;
        std::int32_t body = -1;
        const auto end_body = [&] {
            speed += std::sqrt(mobility * energy);
            mobility = energy = 0.0;
        };
        for_each_entry(D, row, 1, [&](std::size_t, std::size_t column, double value) {
            if (body_[column] != body) end_body();
            body = body_[column];
            mobility += value * value / mass_[column];
            energy += energy_[column];
            speed += std::abs(value) * speed_[column];
        });
        end_body();
        return h_ * speed;
    }

private:
    std::vector<std::int32_t> body_;  // of each column
    double h_ = 0.0, digits_ = 0.0;
    std::vector<double> mass_, speed_, energy_;
};

}  // namespace delassus
