// SPDX-License-Identifier: BSD-3-Clause
// Steps of a method that are longer than those that are shown (internal).
#pragma once

#include <cstdint>
#include <vector>

#include "delassus/adaptive_stepping.hpp"
#include "delassus/continuous_extension.hpp"
#include "delassus/joint_coordinates.hpp"
#include "delassus/multibody.hpp"

namespace delassus {

/// How far a method has come ahead of what is shown, and the way of its last step.
class LookAhead {
public:
    /// bodies: whose motions have the corners; joints: what `system` is, or null. step: between the states shown, s;
    /// smallest: of the method's, s. All that is passed outlives it.
    LookAhead(DynamicalSystem& system, const MultibodySystem& bodies, const JointCoordinates* joints, double step,
              double smallest);

    /// Where the method has come to.
    [[nodiscard]] const State& front() const { return way_.end; }
    /// Goes on from this state; what was ahead is forgotten.
    void begin(const State& state);
    /// Whether `to` can be shown without a further step.
    [[nodiscard]] bool reaches(double to) const { return way_.end.t >= to; }
    /// Steps shown that needed a step of the method.
    [[nodiscard]] std::int64_t advances() const { return advances_; }
    void count_advance() { ++advances_; }

    /// One step of the method from the front on, for a state to be shown at `to`. Throws as control.step(); then what
    /// was ahead is as before.
    AdaptiveStepReport advance(double to, const Timestepper& stepper, AdaptiveStepping& control, StepSolver& solver);
    /// Whether a corner made the last step as short as it was.
    [[nodiscard]] bool cut_by_corner() const { return cut_; }
    /// state ← that at `to`, which the method has reached; the problems solved go to the report.
    void show(double to, State& state, StepSolver& solver, StepReport& report);
    /// The same, off the constraints by the error of the way.
    void read(double to, State& state) { output_.read(way_, to, state); }
    /// λ of the bilateral constraints at a state that was shown last.
    [[nodiscard]] std::vector<double> multipliers(const State& state, StepSolver& solver);

    [[nodiscard]] std::vector<double> save() const;
    /// Throws InputError if it is of another system.
    void load(const std::vector<double>& memory);

    /// To be put back where a step fails.
    struct Memory {
        ContinuousExtension way;
        std::int64_t advances;
    };
    [[nodiscard]] Memory memory() const { return {way_, advances_}; }
    void put_back(Memory memory);

private:
    [[nodiscard]] double largest();
    /// Whether many corners follow this one closely.
    [[nodiscard]] bool clustered(double corner) const;

    DynamicalSystem& system_;
    const MultibodySystem& bodies_;
    const JointCoordinates* joints_;
    State front_;  // of the bodies; memory
    double step_, smallest_;
    DenseOutput output_;
    ContinuousExtension way_;
    std::int64_t advances_ = 0;
    bool cut_ = false;
};

}  // namespace delassus
