// SPDX-License-Identifier: BSD-3-Clause
// The single runs that a suite consists of, each known by a key of its content.
#pragma once

#include <string>
#include <vector>

#include "bench/suite.hpp"

namespace delassus::bench {

struct TaskProblem {
    ProblemSource source;
    std::string name, family;
    ProblemFacts facts;
};

struct SolveTask {
    std::string key;
    std::size_t problem = 0, solver = 0;  ///< indices
    std::string law;                      ///< in force, never empty
    double tolerance = 0.0;
    int processes = 0;  ///< as of MeasureRequest
};

struct TaskScene {
    SuiteScene entry;
    SceneFacts facts;
    double smallest_step = 0.0;  ///< s, of its runs
};

struct SimulationTask {
    std::string key;
    std::size_t scene = 0;    ///< index
    SimulateRequest request;  ///< step never 0; without state and reference
};

/// A scene as it is, and with nothing left out.
struct LeavingOutTask {
    std::string key;
    SuiteScene entry;
    SceneFacts facts;
};

struct Tasks {
    std::vector<TaskProblem> problems;  ///< each content once, whatever names it has
    std::vector<SolveTask> solves;      ///< by problem, law, solver, processes, tolerance
    std::vector<TaskScene> scenes;
    std::vector<SimulationTask> simulations;  ///< by scene, timestepper, solver, step
    std::vector<LeavingOutTask> leaving_out;
};

/// Reads every problem and plans every scene in processes of their own. code: hash of the program. Throws InputError.
/// shares: by solver, whether it takes problems in parts; the others run in one process only.
[[nodiscard]] Tasks make_tasks(const Suite& suite, const WorkerSettings& worker, const std::string& code,
                               const std::vector<bool>& shares);

}  // namespace delassus::bench
