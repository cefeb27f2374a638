// SPDX-License-Identifier: BSD-3-Clause
// `auto`: the solver that chooses solvers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "delassus/registry.hpp"
#include "delassus/solver.hpp"

namespace delassus {

inline constexpr const char* auto_name = "auto";
/// In a plugin folder: the orders of solvers. It is not a sidecar.
inline constexpr const char* ranking_file_name = "ranking.json";

/// What `delassus plugins info auto` shows. Its capabilities are the union of all registered plugins'.
[[nodiscard]] PluginInfo auto_info(const Registry& registry);

/// Throws InputError on a bad option or ranking. The registry must outlive the solver.
[[nodiscard]] Solver make_auto(const Registry& registry, OptionTexts options);

/// The plugins that `auto` may load for problems with these needs (DELASSUS_CAN_* bits), of whatever size.
struct AutoChoice {
    std::vector<std::string> first;  ///< that start; more than one where it depends on m
    std::vector<std::string> later;  ///< that are loaded if those before them do not reach the tolerance
};
/// options: as configured. Throws as make_auto.
[[nodiscard]] DELASSUS_API AutoChoice auto_choice(const Registry& registry, OptionTexts options, std::uint64_t needs,
                                                  Origin origin);

}  // namespace delassus
