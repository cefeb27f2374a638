// SPDX-License-Identifier: BSD-3-Clause
// Steps at rest are taken once (internal).
#pragma once

#include "delassus/adaptive_stepping.hpp"
#include "delassus/step_solver.hpp"

namespace delassus {

/// A step is a function of the state, of its size and of what methods and layers keep. Where nothing depends on time,
/// one that leaves all of these as they were, to the bit, is what all that follow are, until something changes from
/// outside.
class UnchangedStep {
public:
    /// A step was taken that changed nothing.
    void note(const AdaptiveStepReport& report, const SolverEffort& effort) {
        report_ = report;
        effort_ = effort;
        noted_ = true;
    }
    void forget() { noted_ = false; }

    /// Takes a step of this size as the one that was noted. False: the last one was none such, and it has to be taken.
    [[nodiscard]] bool repeat(double h, AdaptiveStepReport& report) {
        repeated_ = noted_ = noted_ && h == report_.h;
        if (repeated_) report = report_;
        return repeated_;
    }
    /// Of the step that was noted, if the last one was taken like that; else null.
    [[nodiscard]] const SolverEffort* repeated() const { return repeated_ ? &effort_ : nullptr; }

private:
    bool noted_ = false, repeated_ = false;
    AdaptiveStepReport report_;
    SolverEffort effort_;
};

}  // namespace delassus
