// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/simulation.hpp"
#include "simulation/run_check.hpp"
#include "simulation/run_loop.hpp"

namespace delassus {

/// The status of a run as reports say it: finished, unsolved, interrupted or failed.
DELASSUS_API std::string_view status_word(RunStatus status);

/// Simulation::shares() of each system; nothing where no process asked.
using SharesOfSystems = std::vector<std::vector<Simulation::Share>>;

/// The report as JSON text (docs/running.md). checks: of each system, or nothing.
DELASSUS_API std::string run_report_json(const std::string& scene, const Scene& read,
                                         std::vector<Simulation>& simulations, const RunResult& result,
                                         const SharesOfSystems& shares = {}, const std::vector<RunCheck>& checks = {});

}  // namespace delassus
