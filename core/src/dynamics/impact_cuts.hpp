// SPDX-License-Identifier: BSD-3-Clause
// Steps that are cut between impacts that follow one another within them (internal).
#pragma once

#include <cstdint>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/timestepper.hpp"

namespace delassus {

/// Takes the steps of a method. One in which an impact leads to another is cut between them, as often as it has to be:
/// the second one then has the speed with which its bodies meet. Restitution gives back no more than there was: else
/// the step stays whole.
class DELASSUS_API ImpactCuts {
public:
    /// Outlives this.
    explicit ImpactCuts(DynamicalSystem& system) : system_(system) {}

    /// As Timestepper::step(), cut at StepReport::cut.
    void step(Timestepper& stepper, State& state, double h, StepSolver& solver, StepReport& report);

    /// Cuts a step of size h that was taken at StepReport::second_impact_cut, at most so many times. memory: the
    /// method's at `begin`. Returns whether state, report and the method's memory are now those of the parts.
    bool cut(Timestepper& stepper, const State& begin, std::vector<double> memory, double h, std::int64_t most,
             State& state, StepSolver& solver, StepReport& report);

private:
    /// Which times of a report say where to cut.
    using Cut = double StepReport::*;
    /// A step in parts that end between its impacts, the first of this length. most: cuts. memory: the method's at
    /// `state`.
    static void step_in_cuts(Timestepper& stepper, State& state, double h, double first, std::vector<double> memory,
                             std::int64_t most, Cut cut, StepSolver& solver, StepReport& report);
    /// As cut().
    bool try_cuts(Timestepper& stepper, const State& begin, std::vector<double> memory, double h, std::int64_t most,
                  Cut cut, State& state, StepSolver& solver, StepReport& report);
    [[nodiscard]] double kinetic(const State& state);
    /// What contacts give on the way from one state to another, J.
    [[nodiscard]] double gain(const State& from, const State& to);

    DynamicalSystem& system_;
    std::vector<double> momentum_, way_, forces_;
};

}  // namespace delassus
