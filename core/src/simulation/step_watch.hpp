// SPDX-License-Identifier: BSD-3-Clause
// What looks at steps before they count (internal).
#pragma once

#include <cstdint>

#include "delassus/timestepper.hpp"

namespace delassus {

/// Says of one fixed step whether it is too long for the motion, and what helps besides substeps. Stepping calls the
/// members in the order in which they stand here. States are those of the timestepper.
class StepWatch {
public:
    virtual ~StepWatch() = default;

    /// The step, of size h, begins.
    virtual void begin(const State& state, double h) = 0;
    /// It is tried in so many equal substeps. again: with the step before.
    virtual void begin_trial(std::int64_t substeps, bool again) = 0;
    /// After one of size h that led to `state`. last: it ends the step. Throws StepTooLong if it must not count.
    virtual void judge(const State& state, double h, const StepReport& report, bool last) = 0;
    /// The whole step, which led to `state`, failed so: whether it may do better if it is tried again as a whole.
    /// Throws an earlier failure where that is what substeps are to cure.
    [[nodiscard]] virtual bool mend(const StepTooLong& failure, const StepReport& report, const State& state) = 0;
    /// Substeps follow, to cure this.
    virtual void begin_substeps(const StepTooLong& failure) = 0;
    /// They did not cure it, and failed so at last. Whether the step is tried again, with less that is judged.
    [[nodiscard]] virtual bool give_up(const StepTooLong& failure, const StepFailure& last) = 0;
    /// The step counts.
    virtual void end() = 0;
};

}  // namespace delassus
