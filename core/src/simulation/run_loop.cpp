// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/run_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>

#include "delassus/error.hpp"

namespace delassus {

namespace {

using StepClock = std::chrono::steady_clock;

double seconds_since(StepClock::time_point begin) {
    return std::chrono::duration<double>(StepClock::now() - begin).count();
}

/// The system that is farthest behind, or none if all have reached their ends.
std::optional<std::size_t> next_system(const std::vector<Simulation>& simulations) {
    std::optional<std::size_t> next;
    for (std::size_t i = 0; i < simulations.size(); ++i)
        if (!simulations[i].finished() && (!next || simulations[i].state().t < simulations[*next].state().t)) next = i;
    return next;
}

/// Of a run in which every system reached its end.
void judge(const std::vector<Simulation>& simulations, RunResult& result) {
    for (const auto& simulation : simulations) {
        const auto& totals = simulation.totals();
        if (totals.unsolved_steps > 0 && result.status == RunStatus::Finished) {
            result.status = RunStatus::Unsolved;
            result.message = fmt::format("{} of {} steps missed the solver's tolerance, first {}",
                                         totals.unsolved_steps, simulation.record().step, totals.first_unsolved);
        }
    }
}

void step_to_end(std::vector<Simulation>& simulations, const RunHooks& hooks, RunResult& result) {
    for (auto next = next_system(simulations); next; next = next_system(simulations)) {
        if (hooks.interrupted && hooks.interrupted()) {
            result.status = RunStatus::Interrupted;
            return;
        }
        const auto begin = StepClock::now();
        try {
            simulations[*next].step();
        } catch (const StepInterrupted&) {
            result.status = RunStatus::Interrupted;
        } catch (const StepFailure& error) {
            result.status = RunStatus::Failed;
            result.message = error.what();
        } catch (const Unsupported& error) {
            result.status = RunStatus::Unsupported;
            result.message = error.what();
        }
        result.step_seconds += seconds_since(begin);
        if (result.status != RunStatus::Finished) return;
        if (hooks.stepped) hooks.stepped(*next);
        if (result.step_seconds > hooks.time_limit) {
            result.status = RunStatus::TimeLimit;
            return;
        }
    }
    judge(simulations, result);
}

}  // namespace

RunResult run_to_end(std::vector<Simulation>& simulations, const RunHooks& hooks) {
    const auto begin = StepClock::now();
    RunResult result;
    step_to_end(simulations, hooks, result);
    result.seconds = seconds_since(begin);
    return result;
}

double reached_time(const std::vector<Simulation>& simulations) {
    double t = simulations.front().state().t;
    for (const auto& simulation : simulations) t = std::min(t, simulation.state().t);
    return t;
}

}  // namespace delassus
