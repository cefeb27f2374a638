// SPDX-License-Identifier: BSD-3-Clause
// Steps at rest are taken once (internal).
#pragma once

#include <vector>

#include "delassus/step_solver.hpp"
#include "delassus/timestepper.hpp"

namespace delassus {

/// A step is a function of the state, of its size and of what the method keeps. Where nothing depends on time, one that
/// leaves all of these as they were, to the bit, is what all that follow are, until something changes from outside.
class UnchangedStep {
public:
    /// system outlives this.
    explicit UnchangedStep(const DynamicalSystem& system) : system_(system) {}

    /// A step was taken, of size h and with this effort, from where the method kept so much.
    void note(const State& begin, const std::vector<double>& kept, const State& end, double h,
              const Timestepper& stepper, const StepReport& report, const SolverEffort& effort);
    /// Takes one of size h as the one that was noted, if that changed nothing and was of this size: the state's time
    /// goes on.
    [[nodiscard]] bool repeat(State& state, double h, StepReport& report);
    /// Of the step that was noted, if the last one was taken like that; else null.
    [[nodiscard]] const SolverEffort* repeated() const { return repeated_ ? &effort_ : nullptr; }
    void forget() { h_ = 0.0; }

private:
    const DynamicalSystem& system_;
    double h_ = 0.0;  // of the step that changed nothing; 0: there is none
    bool repeated_ = false;
    StepReport report_;
    SolverEffort effort_;
};

}  // namespace delassus
