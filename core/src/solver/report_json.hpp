// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "delassus/solver.hpp"
#include "support/json.hpp"

namespace delassus {

/// The report with the keys of docs/report.md.
[[nodiscard]] nlohmann::ordered_json report_json(const SolveReport& report);

}  // namespace delassus
