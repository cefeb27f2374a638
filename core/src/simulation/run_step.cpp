// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/run_step.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "delassus/error.hpp"
#include "simulation/step_columns.hpp"
#include "support/finite.hpp"

namespace delassus {

std::string RunStep::place() const {
    return fmt::format("{}step {} from t = {:.9g} s", name(), run_.now.step + 1, run_.now.state.t);
}

void RunStep::take() {
    while (!try_to_take()) {
    }
}

bool RunStep::try_to_take() {
    const auto begin = std::chrono::steady_clock::now();
    const std::string where = place();
    State next = run_.now.state;
    try {
        prepare(next);
    } catch (const StepFailure& error) {
        throw StepFailure(fmt::format("{}: {}", where, error.what()));
    }
    AdaptiveStepReport& taken = run_.memory;
    SimulationTotals totals = run_.now.totals;
    const StepRecord last = run_.record;
    run_.solver.reset_effort();
    const auto undo_all = [&] {
        run_.record = last;
        run_.stepping->undo();
        undo();
    };
    try {
        advance(next, taken);
        if (!all_finite(next.q) || !all_finite(next.v))
            throw StepFailure("the state at the end of the step is not finite");
        run_.record = {};
        run_.record.step = run_.now.step + 1;
        measure(next, taken, run_.record);
        judge(taken, totals);
    } catch (const Unsupported& error) {
        undo_all();
        throw Unsupported(fmt::format("{}: {}", where, error.what()));
    } catch (const InputError& error) {
        undo_all();
        throw StepFailure(fmt::format("{}: {}", where, error.what()));
    } catch (const StepInterrupted& error) {
        undo_all();
        throw StepInterrupted(fmt::format("{}: {}", where, error.what()));
    } catch (const StepFailure& error) {
        undo_all();
        const std::string failure = error.what() + what_acts();
        if (go_on(failure)) return false;
        throw StepFailure(fmt::format("{}: {}", where, failure));
    } catch (...) {  // of methods of the system
        undo_all();
        throw;
    }
    run_.now.state = std::move(next);
    run_.now.totals = std::move(totals);
    ++run_.now.step;
    run_.stepping->describe(taken, run_.solver.effort(), run_.record);
    run_.record.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    add_to_totals(where);
    count(where, run_.now.totals);
    std::swap(run_.report, run_.memory);
    return true;
}

void RunStep::add_to_totals(const std::string& place) {
    SimulationTotals& totals = run_.now.totals;
    const AdaptiveStepReport& taken = run_.memory;
    StepRecord counted = run_.record;
    if (run_.stepping->repeated()) counted.newton_iterations = counted.solver_iterations = 0;
    add_step(counted, totals);
    if (taken.refined) {
        ++totals.refined_steps;
    } else if (taken.substeps > 1) {
        ++totals.divided_steps;
        totals.most_substeps = std::max(totals.most_substeps, taken.substeps);
    }
    if (!taken.impact) {
        totals.smallest_step = totals.largest_step == 0.0 ? taken.h : std::min(totals.smallest_step, taken.h);
        totals.largest_step = std::max(totals.largest_step, taken.h);
    }
    if (taken.error > 1.0 && std::isfinite(run_.record.error)) ++totals.inexact_steps;
    const SolverEffort& effort = run_.solver.effort();
    totals.plugin_solves += effort.plugin_solves;
    totals.resting_parts += effort.resting_parts;
    totals.repeated_solves += effort.repeated;
    totals.failed_solves += effort.failed;
    if (totals.first_failure.empty()) totals.first_failure = effort.failure;
    totals.near_goal_solves += effort.near_goal;
    totals.solver_seconds += effort.seconds;
    if (taken.step.solved) return;
    ++totals.unsolved_steps;
    if (totals.first_unsolved.empty()) totals.first_unsolved = fmt::format("{}: {}", place, taken.step.message);
}

}  // namespace delassus
