// SPDX-License-Identifier: BSD-3-Clause
// How a system comes from one state that is shown to the next (internal).
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "delassus/adaptive_stepping.hpp"
#include "delassus/export.hpp"
#include "delassus/simulation.hpp"
#include "delassus/step_solver.hpp"
#include "delassus/timestepper.hpp"
#include "dynamics/impact_cuts.hpp"
#include "simulation/fixed_step.hpp"
#include "simulation/look_ahead.hpp"
#include "simulation/step_watch.hpp"
#include "simulation/unchanged_step.hpp"

namespace delassus {

class SharedRun;

/// What the steps of a system follow from.
struct SteppingSettings {
    double step = 0.0, end = 0.0;        ///< between states that are shown, and of the run, s
    std::optional<StepControl> chosen;   ///< steps follow from a tolerance; `step` means nothing then
    std::optional<StepControl> divided;  ///< how fixed steps are divided, where the method has no error_limit()
    std::optional<StepControl> judged;   ///< what others may err by, where the method is of order 1 or 2
    bool refines = false;                ///< those that err by more are divided by their error while that is cheap
    double accuracy = 0.0;    ///< off constraints by no more, a state is shown where it cannot be returned to them
    std::string advice;       ///< what to do where no substep is short enough
    bool restitutes = false;  ///< there is restitution: steps are cut between impacts
};

// One step that is shown is, from the inside out:
//
//     a step of the method            Timestepper; of several processes, SharedRun
//     cut between impacts             ImpactCuts, where there is restitution
//     cut by what time prescribes     where it jumps, or oscillates within the step
//     in 2, 4, … equal substeps       where the method or the watch calls it too long
//     again, by their error           where it errs by more than the accuracy, and that costs little
//   or
//     in substeps by their error      AdaptiveStepping, where there is an error limit, an accuracy or a tolerance
//     longer than what is shown       LookAhead, where the method knows the way of its steps
//   or
//     as the last one                 UnchangedStep, where that changed nothing
//
/// The layers around the step of a method.
class DELASSUS_API Stepping {
public:
    /// system outlives this; timestepper is made for it. shared: by other processes, outlives this; or null.
    Stepping(DynamicalSystem& system, std::unique_ptr<Timestepper> timestepper, SteppingSettings settings,
             SharedRun* shared = nullptr);
    ~Stepping();

    /// Whether t is the end of the run.
    [[nodiscard]] bool ends(double t) const;
    /// The fixed step from t on.
    [[nodiscard]] FixedStep next(double t) const { return fixed_step(t, settings_.end, settings_.step); }

    /// state ← the next one that is shown. watch: of fixed steps that are not divided by their error, or null. Throws
    /// StepFailure, or Unsupported as the method does; call undo() then.
    void advance(State& state, StepSolver& solver, AdaptiveStepReport& report, StepWatch* watch = nullptr);
    /// Everything but the state is as before the last advance().
    void undo();

    /// The state was changed from outside, or what acts on it has jumped.
    void begin_anew(const State& state);
    /// λ of the bilateral constraints at the state that was shown last; report: of its step.
    [[nodiscard]] std::vector<double> multipliers(const State& state, StepSolver& solver, const StepReport& report);

    /// SharedRun replaces it.
    [[nodiscard]] std::unique_ptr<Timestepper>& timestepper() { return timestepper_; }
    /// Shows states by steps that are longer; null: there are none such.
    [[nodiscard]] LookAhead* ahead() { return ahead_.get(); }
    void look_ahead(std::unique_ptr<LookAhead> ahead) { ahead_ = std::move(ahead); }
    /// Whether the last step was that before it, without another solve.
    [[nodiscard]] bool repeated() const { return unchanged_.repeated() != nullptr; }
    /// record ← what is known of a step that advance() took, but for what states and clocks say.
    void describe(const AdaptiveStepReport& taken, const SolverEffort& spent, StepRecord& record) const;
    /// Whether fixed steps are divided by their error.
    [[nodiscard]] bool has_limit() const { return control_ && !settings_.chosen; }

    [[nodiscard]] SteppingMemory save() const;
    void load(const SteppingMemory& memory, const State& state);
    /// That of the choice of steps goes on with another method.
    void keep_control_of(const Stepping& other);

private:
    void take(State& state, double h, StepSolver& solver, StepReport& report);
    /// Whether the step that advance() took left everything as it was, so that the next one will.
    [[nodiscard]] bool changed_nothing(const State& end, const StepReport& report, const StepSolver& solver) const;
    /// Where a step from t on to `end` ends, so that what time prescribes is smooth and slow in it.
    [[nodiscard]] double cut(double t, double end) const;
    /// The method forgets what acted before, if something that time prescribes jumps at the state.
    void pass_jump(const State& state);
    void step_fixed(State& state, StepSolver& solver, AdaptiveStepReport& report, StepWatch* watch);
    void step_whole(State& state, StepSolver& solver, AdaptiveStepReport& report, StepWatch* watch);
    void step_in_substeps(State& state, StepSolver& solver, AdaptiveStepReport& report, StepWatch* watch,
                          const StepTooLong& failure);
    void try_substeps(std::int64_t substeps, State& state, StepSolver& solver, AdaptiveStepReport& report,
                      StepWatch* watch);
    /// Steps of `control` to `end`, or until they have taken more than this work.
    void step_within_error(AdaptiveStepping& control, State& state, double end, StepSolver& solver,
                           AdaptiveStepReport& report, double most_work = HUGE_VAL);
    [[nodiscard]] double work_of(const StepReport& report, std::int64_t iterations) const;
    /// What positions may err by a second, as a share of the size of what moves and in rad: AdaptiveStepReport::error
    /// is over it. NaN where nobody says so: the method follows a limit of its own, or a tolerance, or is of high
    /// order.
    [[nodiscard]] double allowed() const;
    /// What a step of size h errs by, over what is allowed; NaN where it is not known.
    [[nodiscard]] double error_of(const StepReport& report, double h) const;
    void refine(State& state, StepSolver& solver, AdaptiveStepReport& report, StepWatch* watch);
    /// Of a step that was taken, as far as there is work for it. Returns whether it errs by no more than `looser` then.
    bool cut_between_impacts(double looser, State& state, StepSolver& solver, AdaptiveStepReport& report,
                             StepWatch* watch);
    /// state, report and the method's memory ← those of a step that was taken before.
    void take_back(const State& whole, AdaptiveStepReport of_whole, const std::vector<double>& after, State& state,
                   AdaptiveStepReport& report, StepWatch* watch);
    /// counted: of the step before, if it is taken again.
    void take_refined(double looser, State& state, double end, const StepEnergy& counted, StepSolver& solver,
                      AdaptiveStepReport& report, StepWatch* watch);
    static void judge(const State& state, const AdaptiveStepReport& report, StepWatch& watch);
    void step_ahead(State& state, double end, StepSolver& solver, AdaptiveStepReport& report);
    void show_ahead(State& state, double end, StepSolver& solver, AdaptiveStepReport& report);
    void go_back(State& state);

    DynamicalSystem& system_;
    SteppingSettings settings_;
    SharedRun* shared_;
    std::unique_ptr<Timestepper> timestepper_;
    std::unique_ptr<ImpactCuts> cuts_;  // or empty
    UnchangedStep unchanged_;
    std::unique_ptr<AdaptiveStepping> control_;  // of chosen steps, or of the substeps of fixed ones; or empty
    double work_ = 0.0;                          // that may be spent now on fixed steps that err by too much
    std::unique_ptr<LookAhead> ahead_;           // empty where no step is longer than those shown
    /// Where a step began.
    struct Beginning {
        State state;
        std::vector<double> method;
        bool whole = false;   // the step was taken as a whole, and nothing was changed from outside since
        StepEnergy energy{};  // of that step
    };
    Beginning last_, older_, oldest_;  // of the last advance(), and of those before it
    bool reads_ = false;               // all was known already, and nothing has changed
    std::vector<double> control_before_;
    double work_before_ = 0.0;
    std::optional<LookAhead::Memory> ahead_before_;
    StepReport substep_;  // memory
};

}  // namespace delassus
