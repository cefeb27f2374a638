// SPDX-License-Identifier: BSD-3-Clause
// `auto`: the solver that chooses solvers.
#pragma once

#include "delassus/registry.hpp"
#include "delassus/solver.hpp"

namespace delassus {

inline constexpr const char* auto_name = "auto";
/// In a plugin folder: who solves what. It is no sidecar.
inline constexpr const char* ranking_file_name = "ranking.json";

/// What `delassus plugins info auto` shows. It can what any plugin of the registry can.
[[nodiscard]] PluginInfo auto_info(const Registry& registry);

/// Throws InputError on a bad option or ranking. The registry must outlive the solver.
[[nodiscard]] Solver make_auto(const Registry& registry, OptionTexts options);

}  // namespace delassus
