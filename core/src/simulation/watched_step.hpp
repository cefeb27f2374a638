// SPDX-License-Identifier: BSD-3-Clause
// A fixed step whose overlaps and gain of energy are watched (internal).
#pragma once

#include <optional>
#include <string>

#include "delassus/joint_coordinates.hpp"
#include "delassus/multibody.hpp"
#include "delassus/step_solver.hpp"
#include "simulation/energy_guard.hpp"
#include "simulation/overlap_watch.hpp"
#include "simulation/step_retries.hpp"
#include "simulation/step_watch.hpp"

namespace delassus {

/// Lives for one step. When it ends, the solver and the system are as before.
class WatchedStep : public StepWatch {
public:
    /// Null where nothing is watched. All outlive this.
    struct Watched {
        OverlapWatch* overlaps = nullptr;
        EnergyWatch* energy = nullptr;
        const SimulationTotals* totals = nullptr;  ///< before the step
    };
    /// joints: of the states, or null: they are those of the bodies. expects: whether rows for pairs without a contact
    /// help (StepRetries). bodies: memory.
    WatchedStep(MultibodySystem& system, const JointCoordinates* joints, StepSolver& solver, Watched watched,
                bool expects, State& bodies)
        : system_(system), joints_(joints), solver_(solver), watched_(watched), expects_(expects), bodies_(bodies) {}
    WatchedStep(const WatchedStep&) = delete;
    WatchedStep& operator=(const WatchedStep&) = delete;
    ~WatchedStep() override;

    void begin(const State& state, double h) override;
    void begin_trial(std::int64_t substeps, bool again) override;
    void judge(const State& state, double h, const StepReport& report, bool last) override;
    [[nodiscard]] bool mend(const StepTooLong& failure, const StepReport& report, const State& state) override;
    void begin_substeps(const StepTooLong& failure) override;
    [[nodiscard]] bool give_up(const StepTooLong& failure, const StepFailure& last) override;
    void end() override;

    /// What came to overlap whatever the substeps, a sentence; or empty.
    [[nodiscard]] const std::string& deep() const { return deep_; }

private:
    [[nodiscard]] const State& bodies_at(const State& state);

    MultibodySystem& system_;
    const JointCoordinates* joints_;
    StepSolver& solver_;
    Watched watched_;
    bool expects_;
    State& bodies_;
    std::optional<StepRetries> retries_;
    bool closes_ = false;  // what solves leave of gaps shrinks with the substeps
    std::string deep_;
};

}  // namespace delassus
