// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "delassus/needs.hpp"

namespace delassus {

/// The DELASSUS_CAN_* bit that a problem of this structure, or with friction under this law, needs.
[[nodiscard]] std::uint64_t need_of(Structure structure);
[[nodiscard]] std::uint64_t need_of(Law law);

}  // namespace delassus
