// SPDX-License-Identifier: BSD-3-Clause
// Sections that a configuration and a scene have in common.
#pragma once

#include "config/yaml_reader.hpp"
#include "delassus/config.hpp"
#include "delassus/export.hpp"

namespace delassus {

/// The "options" map of a solver or an integrator.
DELASSUS_API OptionTexts read_options(const Source& source, const YAML::Node& node);

/// The "solver" section: a name, or a map.
DELASSUS_API SolverConfig read_solver(const Source& source, const YAML::Node& node);

}  // namespace delassus
