// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "delassus/needs.hpp"

namespace delassus {

/// The DELASSUS_CAN_* bit that a problem of this structure, or with friction under this law, needs.
[[nodiscard]] std::uint64_t need_of(Structure structure);
[[nodiscard]] std::uint64_t need_of(Law law);

/// For each kind of cone, how many there are: rows where they separate, else blocks.
[[nodiscard]] std::vector<std::int64_t> counts_of(const std::vector<Cone>& cones);
/// The missing needs as a person would say them, e.g. "1421 friction cones, the exact Coulomb law".
[[nodiscard]] std::string describe_needs(std::uint64_t missing, std::span<const std::int64_t> counts);

}  // namespace delassus
