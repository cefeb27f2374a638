// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/fixed_step.hpp"

#include <fmt/format.h>

#include <utility>

#include "simulation/overlap_watch.hpp"

namespace delassus {

Parts step_within_error(AdaptiveStepping& control, State& state, double end, StepSolver& solver, StepReport& report) {
    report.clear();
    Parts parts;
    for (; state.t < end; ++parts.taken) {
        AdaptiveStepReport part = control.step(state, end, solver);
        part.step.follow(report);
        std::swap(report, part.step);
        parts.rejected += part.rejected;
        parts.error = std::max(parts.error, part.error);
    }
    return parts;
}

std::int64_t step_in_parts(Timestepper& timestepper, const TakeStep& take, const State& begin,
                           const std::vector<double>& memory, double h, State& state, StepReport& report,
                           const StepTooLong& failure) {
    // Where rounding makes more of the linear model's error than this, nobody knows whether parts are short enough.
    constexpr double most_rounding = 0.1;
    for (std::int64_t parts = 2; parts <= most_parts; parts *= 2) {
        state = begin;
        timestepper.restart();
        timestepper.load(memory);
        StepReport part;
        report.clear();
        try {
            for (std::int64_t i = 0; i < parts; ++i) {
                take(state, h / static_cast<double>(parts), part);
                if (part.linearization_rounding > most_rounding) throw StepTooLong(failure.what());
                part.follow(report);
                std::swap(report, part);
            }
            return parts;
        } catch (const StepTooDeep&) {
            if (parts == most_parts) throw;
        } catch (const StepTooLong&) {
        }
    }
    throw StepFailure(fmt::format("{}; {} parts of it are too long as well", failure.what(), most_parts));
}

}  // namespace delassus
