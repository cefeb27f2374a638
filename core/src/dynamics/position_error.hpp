// SPDX-License-Identifier: BSD-3-Clause
// What a step of the θ-method errs by in positions, as far as it tells by itself (internal).
#pragma once

#include <Eigen/Core>

#include <span>
#include <utility>
#include <vector>

#include "delassus/timestepper.hpp"

namespace delassus {

/// Of the change of a velocity by impacts, beyond which it says no acceleration.
inline constexpr double mostly = 0.5;
/// Of a step: over a shorter one before it, what changed is what its solve left, and says nothing of forces.
inline constexpr double short_share = 1e-3;

class PositionError {
public:
    /// ½ ≤ theta ≤ 1.
    explicit PositionError(double theta) : theta_(theta) {}

    /// What a step of size h, after one of last_h (0: none), changed velocities by besides free spins, n, and the share
    /// of impacts in it, n.
    struct Step {
        double h, last_h;
        const Eigen::VectorXd& change;
        std::span<const double> struck;
        bool timed;   ///< impacts have the time of their meeting
        bool bounce;  ///< and all of them end in a bounce
    };
    /// report.error ← of that step, n, or nothing where it is not known. Returns whether the step before tells of it.
    bool note(const Step& step, StepReport& report);

    /// What acts has jumped since.
    void forget() { acceleration_.clear(); }
    /// Of the last step, but for impacts; n, or empty. For checkpoints.
    [[nodiscard]] const std::vector<double>& acceleration() const { return acceleration_; }
    void load(std::vector<double> acceleration) { acceleration_ = std::move(acceleration); }

private:
    double theta_;
    std::vector<double> acceleration_;
};

}  // namespace delassus
