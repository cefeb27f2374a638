// SPDX-License-Identifier: BSD-3-Clause
// `mpirun -n P delassus solve` with a solver that shares the problem among the processes.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "delassus/communicator.hpp"
#include "delassus/config.hpp"
#include "delassus/repartition.hpp"
#include "delassus/solver.hpp"

namespace delassus::command {

struct PartsArguments {
    std::filesystem::path problem, warm_start, solution;
    bool json = false, curve = false;
    Partitioning partition = Partitioning::Automatic;
};

/// Solves on all processes together and reports on process 0; the exit code. Nothing if the solver is auto and no
/// solver of partitioned problems takes this one: the problem then goes to every process as a whole. Collective.
[[nodiscard]] std::optional<int> solve_in_parts(const std::shared_ptr<const Communicator>& run,
                                                const PartsArguments& arguments, const Registry& registry,
                                                const Config& config);

/// The report for people.
void print_report(const SolveReport& report);

}  // namespace delassus::command
