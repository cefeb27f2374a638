// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/turning_axes.hpp"

#include <algorithm>
#include <cmath>

namespace delassus {

namespace {

Eigen::Quaterniond turn_by(const Eigen::Vector3d& vector) {
    const double angle = vector.norm();
    return angle > 0.0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, vector / angle)) : Eigen::Quaterniond::Identity();
}

}  // namespace

TurningAxes::TurningAxes(const DynamicalSystem& system) : number_(static_cast<std::size_t>(system.n()), -1) {
    std::vector<DiagonalBlock3> rotations;
    const std::vector<double> rest(static_cast<std::size_t>(system.n()), 0.0);
    system.inverse_tangent(rest.data(), rotations);
    for (const DiagonalBlock3& rotation : rotations) {
        number_[static_cast<std::size_t>(rotation.first)] = static_cast<std::int32_t>(columns_.size());
        columns_.push_back(rotation.first);
    }
}

void TurningAxes::begin(const double* velocities, double middle, double h) {
    constexpr double largest = 1.2;  // nobody resolves more of a turn
    velocities_ = velocities;
    to_begin_.clear();
    stretches_.clear();
    for (const std::int32_t column : columns_) {
        const Eigen::Vector3d turn = middle * Eigen::Map<const Eigen::Vector3d>(velocities + column);
        to_begin_.push_back(turn_by(turn));
        const double x = std::min(turn.norm(), largest);
        stretches_.push_back(x > 0.0 && 2.0 * middle == h ? 1.0 / std::cos(x) : 1.0);
    }
}

Eigen::Vector3d TurningAxes::later(double time, std::int32_t column, const Eigen::Vector3d& entries) const {
    return turn_by(-time * Eigen::Map<const Eigen::Vector3d>(velocities_ + column)) * entries;
}

Eigen::Vector3d TurningAxes::across(std::int32_t column, const Eigen::Vector3d& vector, double share) const {
    const Eigen::Map<const Eigen::Vector3d> omega(velocities_ + column);
    const double square = omega.squaredNorm();
    if (!(square > 0.0)) return vector;
    return share * vector + (1.0 - share) * (omega.dot(vector) / square) * omega;
}

void TurningAxes::stretch(std::size_t first_row, SparseMatrix& D) const {
    for (std::size_t row = first_row; row < static_cast<std::size_t>(D.rows); ++row) {
        const auto end = static_cast<std::size_t>(D.row_start[row + 1]);
        for (auto e = static_cast<std::size_t>(D.row_start[row]); e < end; ++e) {
            if (!at(D.column, e, end)) continue;
            Eigen::Map<Eigen::Vector3d> entries(&D.value[e]);
            entries = across(D.column[e], entries, stretches_[number(D.column[e])]);
            e += 2;
        }
    }
}

void TurningAxes::turn(std::span<const double> end, double h, double theta, std::vector<double>& in_begin,
                       std::vector<double>& in_middle) const {
    in_begin.assign(end.begin(), end.end());
    in_middle.assign(end.begin(), end.end());
    for (std::size_t k = 0; k < columns_.size(); ++k) {
        const std::int32_t column = columns_[k];
        const Eigen::Map<const Eigen::Vector3d> before(velocities_ + column), after(end.data() + column);
        const Eigen::Vector3d turned = turn_by(h * ((1.0 - theta) * before + theta * after)) * after;
        Eigen::Map<Eigen::Vector3d>(in_begin.data() + column) = turned;
        Eigen::Map<Eigen::Vector3d>(in_middle.data() + column) = unstretched(column, to_begin_[k].conjugate() * turned);
    }
}

}  // namespace delassus
