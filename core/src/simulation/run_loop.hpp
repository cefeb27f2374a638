// SPDX-License-Identifier: BSD-3-Clause
// The run loop: all systems of a scene, step by step to their ends.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/simulation.hpp"

namespace delassus {

enum class RunStatus {
    Finished,     ///< every system reached its end, and every solve its tolerance
    Unsolved,     ///< every system reached its end, but a solve missed its tolerance
    Failed,       ///< a step failed
    Unsupported,  ///< a solver or a timestepper cannot take what a step needs
    Interrupted,
    TimeLimit
};

struct RunResult {
    RunStatus status = RunStatus::Finished;
    std::string message;        ///< what a person should know; empty where the run finished
    double seconds = 0.0;       ///< wall time of the whole run, hooks included
    double step_seconds = 0.0;  ///< wall time within the steps alone
};

struct RunHooks {
    std::function<void(std::size_t)> stepped;                     ///< after each step, with its system's index
    std::function<bool()> interrupted;                            ///< asked before each step
    double time_limit = std::numeric_limits<double>::infinity();  ///< s, on RunResult::step_seconds
};

/// Steps the system that is farthest behind until all have reached their ends or something stops the run. Throws
/// nothing of a step; what a hook throws passes through.
DELASSUS_API RunResult run_to_end(std::vector<Simulation>& simulations, const RunHooks& hooks);

/// The time that the system farthest behind has come to, s. There is at least one.
DELASSUS_API double reached_time(const std::vector<Simulation>& simulations);

}  // namespace delassus
