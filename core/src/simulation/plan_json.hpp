// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/plan.hpp"

namespace delassus {

/// The plans of a scene's systems as JSON (`delassus plan --json`); scene: the name of its file.
[[nodiscard]] DELASSUS_API std::string plan_json(std::string_view scene, const std::vector<SystemPlan>& plans);

}  // namespace delassus
