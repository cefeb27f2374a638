// SPDX-License-Identifier: BSD-3-Clause
// Angular velocities and rows in the axes of bodies that turn within a step (internal).
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "delassus/dynamical_system.hpp"

namespace delassus {

/// Angular velocities have the axes of their bodies, and so have the entries of D beside them: those of one row at two
/// times of a step differ by the turn of these axes even where the bodies touch as they did. exp([ω] t) takes them from
/// axes that are a time t older or younger to the same ones; what is left is the change that the motion of the contact
/// makes.
///
/// A body turns by the mean of its velocities. With ω and Δ across it, φ = h |ω| and complex numbers for the plane
/// across ω, exp(h (ω + ½ Δ)) takes ω + Δ to e^{iφ} Δ − ½ (e^{iφ} − 1) Δ = e^{iφ/2} cos(φ/2) Δ more than ω: to a
/// momentum that has the direction of the middle, but too little of it. So what stands in D across ω gets 1/cos(φ/2) of
/// it, S r̄.
class TurningAxes {
public:
    explicit TurningAxes(const DynamicalSystem& system);

    /// Begins a step with these velocities, n, which outlive it; D is taken at the time `middle` after its beginning,
    /// at q ∘ exp(middle v). h: the step; S is 1 unless `middle` is half of it.
    void begin(const double* velocities, double middle, double h);

    /// Whether the entries of a row from e on, of those that stand before `end`, are beside one angular velocity.
    [[nodiscard]] bool at(std::span<const std::int32_t> columns, std::size_t e, std::size_t end) const {
        return e + 3 <= end && number_[static_cast<std::size_t>(columns[e])] >= 0 && columns[e + 2] == columns[e] + 2;
    }
    /// What stands at a column in the middle, in the axes of the beginning.
    [[nodiscard]] Eigen::Vector3d from_middle(std::int32_t column, const double* entries) const {
        return to_begin_[number(column)] * Eigen::Map<const Eigen::Vector3d>(entries);
    }
    /// The same in the axes of a time that is so much later than theirs, s.
    [[nodiscard]] Eigen::Vector3d later(double time, std::int32_t column, const Eigen::Vector3d& entries) const;
    /// S of the rows from the first one on; and back, of what stands at a column.
    void stretch(std::size_t first_row, SparseMatrix& D) const;
    [[nodiscard]] Eigen::Vector3d unstretched(std::int32_t column, const Eigen::Vector3d& entries) const {
        return across(column, entries, 1.0 / stretches_[number(column)]);
    }

    /// Of velocities w at the end of a step that moves by h ((1 − θ) v + θ v⁺), n: in_begin has them in the axes of its
    /// beginning, and in_middle S⁻¹ w in those of the middle, so that S r̄ makes of it what r̄ makes of w.
    void turn(std::span<const double> end, double h, double theta, std::vector<double>& in_begin,
              std::vector<double>& in_middle) const;

private:
    [[nodiscard]] std::size_t number(std::int32_t column) const {
        return static_cast<std::size_t>(number_[static_cast<std::size_t>(column)]);
    }
    /// A vector with so much of its part across the angular velocity at that column.
    [[nodiscard]] Eigen::Vector3d across(std::int32_t column, const Eigen::Vector3d& vector, double share) const;

    std::vector<std::int32_t> columns_;  // the first ones of angular velocities
    std::vector<std::int32_t> number_;   // of the angular velocity that begins at a column; -1: none
    std::vector<Eigen::Quaterniond> to_begin_;
    std::vector<double> stretches_;  // 1/cos(φ/2)
    const double* velocities_ = nullptr;
};

}  // namespace delassus
