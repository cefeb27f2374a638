// SPDX-License-Identifier: BSD-3-Clause
// The cells of a suite's axes: a value and a method each, run and judged.
#pragma once

#include <string>
#include <vector>

#include "bench/reference.hpp"
#include "bench/suite.hpp"

namespace delassus::bench {

struct CellTask {
    std::string key;
    std::size_t axis = 0, value = 0;       ///< indices
    std::string method;                    ///< for tables
    std::size_t solver = 0;                ///< index in the axis' solvers; of problems
    std::string timestepper, step_solver;  ///< of scenes
};

/// By axis, method, value. code: hash of the program.
[[nodiscard]] std::vector<CellTask> make_cells(const Suite& suite, const std::string& code);

/// The row of an axis in results.jsonl.
[[nodiscard]] Json axis_row(const SuiteAxis& axis);

/// Runs the cell in a process of its own and judges it; its row. cache: of references.
[[nodiscard]] Json run_cell(const WorkerSettings& worker, const Suite& suite, const CellTask& task,
                            const std::filesystem::path& cache);

}  // namespace delassus::bench
