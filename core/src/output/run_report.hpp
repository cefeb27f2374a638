// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/simulation.hpp"

namespace delassus {

/// How a run ended.
struct RunOutcome {
    std::string status;   ///< finished, interrupted, failed or unsolved (a solve missed its tolerance)
    std::string message;  ///< what a person should know; may be empty
    double seconds = 0.0;
};

/// The report as JSON text (docs/running.md).
DELASSUS_API std::string run_report_json(const std::string& scene, const Scene& read,
                                         std::vector<Simulation>& simulations, const RunOutcome& outcome);

}  // namespace delassus
