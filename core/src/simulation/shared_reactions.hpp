// SPDX-License-Identifier: BSD-3-Clause
// What a report says of rows of joints that others imply (internal).
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "delassus/multibody.hpp"

namespace delassus {

/// "a, b, c and 4 more".
inline std::string some_of(const std::vector<std::string>& names) {
    constexpr std::size_t most = 3;
    const auto end = names.begin() + static_cast<std::ptrdiff_t>(std::min(most, names.size()));
    std::string text = fmt::format("{}", fmt::join(names.begin(), end, ", "));
    if (names.size() > most) text += fmt::format(" and {} more", names.size() - most);
    return text;
}

/// Of a system with such rows.
inline std::string shared_reactions(const MultibodySystem& system) {
    return fmt::format("reactions are not unique: of {} they are reported as 0 in these rows, and others carry all",
                       some_of(system.joints_with_rows_left_out()));
}

}  // namespace delassus
