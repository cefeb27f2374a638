// SPDX-License-Identifier: BSD-3-Clause
// Steps whose size follows from a tolerance: any timestepper, with rejection, and with cuts where contacts close.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/timestepper.hpp"

namespace delassus {

/// What a step's size may be, and the error that chooses it (docs/integrators.md, "Steps by tolerance").
struct StepControl {
    double absolute = 1e-4;     ///< in units of positions, as a rule m and rad, or a share of `sizes`; > 0
    double relative = 0.0;      ///< of the way that a coordinate goes in `unit`; ≥ 0
    double unit = 1.0;          ///< of time, as a rule s, in which positions may err by these; > 0
    double initial = 1e-4;      ///< first step to try, as a rule s; > 0
    double smallest = 1e-7;     ///< > 0. A smooth step below it fails; impacts closer together are not told apart
    double largest = 0.1;       ///< ≥ initial
    bool finds_impacts = true;  ///< false: contacts and stops are somebody else's, as if the system had none
    /// Of each velocity's coordinate, in its unit, > 0: what `absolute` is a share of. Empty: 1 each.
    std::vector<double> sizes{};
    double slow = 0.0;  ///< what closes at this speed at most is no impact; 0: at `absolute`
    /// With a method that estimates its own error and does not damp at once: sizes are no longer than the longest way
    /// that the coordinate has gone from where it began, so that small motions are as exact, for their size, as large
    /// ones. Not in steps of the smallest size, which can pass a jump of velocities.
    bool of_way = false;

    /// How steps of size h are divided into substeps that err by a method's error limit at most.
    [[nodiscard]] DELASSUS_API static StepControl within(double limit, double h);
};

/// What a step with a chosen size did.
struct AdaptiveStepReport {
    /// Of the result; its iterations are those of all trials, its reactions and contacts those of its second half.
    StepReport step;
    double h = 0.0;             ///< the size taken
    double error = 0.0;         ///< estimate over tolerance; ≤ 1, but for impacts
    std::int32_t rejected = 0;  ///< trials that were thrown away
    bool impact = false;        ///< a short step for a contact that closed at its beginning
    std::int64_t substeps = 1;  ///< in which it was taken
    bool refined = false;       ///< a fixed step that was divided by its error
    bool again = false;         ///< with the step before, which was taken again
};

/// Chooses the steps of a timestepper. Each trial is taken once as a whole and once as two halves, and the halves are
/// kept; once alone by a method that estimates its own error.
class DELASSUS_API AdaptiveStepping {
public:
    /// system and stepper, made for it, outlive this. advice ends the sentence of a step that would fall below
    /// `smallest`. Throws InputError for values of control outside their ranges.
    AdaptiveStepping(DynamicalSystem& system, Timestepper& stepper, const StepControl& control,
                     std::string advice = "loosen the tolerance, or allow smaller steps by step: {smallest: …}");

    /// Advances state by one step, not beyond end > state.t. Throws StepFailure if a step below `smallest` or trials of
    /// more than so many solves would be needed, Unsupported as the stepper; then state is as before and the stepper's
    /// memory must be loaded again.
    AdaptiveStepReport step(State& state, double end, StepSolver& solver, double most_solves = HUGE_VAL);

    /// Bounds the steps from now on, > 0; below `smallest` it is that. Those longer than `common` may err by a tenth of
    /// the tolerance.
    void set_largest(double largest, double common = std::numeric_limits<double>::infinity());

    /// The size that the next step tries first.
    [[nodiscard]] double next() const { return next_; }

    /// The memory of the choice for checkpoints, that of the stepper apart; load() takes what save() gave.
    [[nodiscard]] std::vector<double> save() const;
    void load(const std::vector<double>& memory);

private:
    /// A step as two halves, compared with the whole.
    struct Trial {
        State end;
        std::vector<double> middle;  ///< velocities between the halves
        StepReport whole, first, second;
        std::vector<double> memory;  ///< of the stepper at the end
        double error = 0.0;          ///< over the tolerance
        double slow = 0.0;           ///< what closes at this speed at most is no impact
        bool touches = false;        ///< a contact, stop or limited motor acts in it
        /// How long after its end, at the speeds there, the first open contact closes; negative: since when one is
        /// closed that no step of it knew, as it was too far to be found where the last one began.
        double closes_in = std::numeric_limits<double>::infinity();

        /// Whether a contact closed in it that the method did not know of, or the speeds after its impacts are in
        /// doubt: the whole and its halves may err alike.
        [[nodiscard]] bool missed() const {
            return closes_in < 0.0 ||
                   std::max({whole.doubtful_speed, first.doubtful_speed, second.doubtful_speed}) > slow;
        }
    };
    [[nodiscard]] Trial take(const State& begin, double h, StepSolver& solver);
    /// When the first impact comes, after the beginning of a trial of size h; infinity if none does.
    [[nodiscard]] double impact_in(const Trial& trial, double h);
    /// Contacts at the ends of a trial of size h: which closes next, and by which it errs.
    void look_at_contacts(const State& begin, Trial& trial, double h, StepSolver& solver);
    /// held_ ← what dry friction holds all through a trial.
    void find_held(const Trial& trial);
    /// By which a trial errs where sliding turns round in it.
    void note_turns(const State& begin, Trial& trial, double h, StepSolver& solver);
    /// Keys of what touches at one end of a trial, by the rows there, or pushes in the half at that end; ascending.
    [[nodiscard]] std::vector<std::uint64_t> find_touching(const UnilateralRows& rows,
                                                           std::vector<std::uint64_t> pushing) const;
    /// By what accelerations change from the beginning of a trial until its end, times its size h: of the velocity, by
    /// its size, that changes most.
    [[nodiscard]] double jump_in(const State& begin, const Trial& trial, double h, StepSolver& solver);
    /// The longest trial before an impact that comes at `impact` in one of size h. h ← its size; 0: there is none.
    [[nodiscard]] Trial until_impact(const State& begin, double impact, double& h, StepSolver& solver);
    [[nodiscard]] double error_of(const State& begin, const State& whole, const State& halves, double h,
                                  bool touches) const;
    [[nodiscard]] double error_of(const State& begin, const State& end, const EmbeddedError& error, double h);
    void extrapolate(const State& whole, State& halves) const;
    /// A step from the state in which a contact closes.
    [[nodiscard]] AdaptiveStepReport take_impact(State& state, double h, double end, StepSolver& solver);
    [[nodiscard]] double impact_step() const;
    [[nodiscard]] double moment() const;
    [[nodiscard]] double size(std::size_t velocity) const {
        return control_.sizes.empty() ? 1.0 : control_.sizes[velocity];
    }
    /// The longest way of a coordinate so far, if the step that is tried is taken.
    [[nodiscard]] double longest_way(std::size_t velocity) const;
    void go(const State& begin, const State& end);
    [[nodiscard]] double power() const;
    /// The factor for the step after one of size h with the estimate `error`, over the tolerance.
    [[nodiscard]] double growth(double error, double h, bool shrunk) const;
    [[nodiscard]] double growth(double error, double last, double most) const;
    /// What the estimate of a step of this size is multiplied by.
    [[nodiscard]] double strictness(double h) const;
    void count(const StepReport& report);

    DynamicalSystem& system_;
    Timestepper& stepper_;
    StepControl control_;
    std::string advice_;
    bool extrapolates_, embedded_;
    bool unilateral_;    // contacts and stops count
    double resolution_;  // of gaps, as a share of sizes
    double common_ = std::numeric_limits<double>::infinity();
    double next_;
    double last_error_ = 1.0;
    double impacts_ = 0.0;  // short steps for impacts since the last long one
    double fastest_ = 0.0;  // of all velocities up to now, over the sizes of their coordinates
    // With of_way: how far each coordinate is from where it began, and was at most.
    std::vector<double> gone_, longest_;
    // Of the step that is being taken:
    std::vector<double> memory_;
    std::vector<double> way_;
    AdaptiveStepReport report_;
    UnilateralRows begin_rows_, rows_;
    std::vector<std::uint64_t> pushed_;  ///< keys, ascending
    std::vector<std::uint64_t> held_;    ///< likewise
};

}  // namespace delassus
