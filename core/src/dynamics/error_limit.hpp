// SPDX-License-Identifier: BSD-3-Clause
// The option `error_limit` of methods that estimate their own errors (internal).
#pragma once

#include <cmath>
#include <limits>

#include "delassus/plugin_info.hpp"

namespace delassus {

/// For Timestepper::error_limit().
inline OptionInfo error_limit_option() {
    return {
        .key = "error_limit",
        .type = DELASSUS_OPTION_REAL,
        .default_value = "inf",
        .minimum = std::numeric_limits<double>::min(),
        .maximum = HUGE_VAL,
        .unit = "m, rad",
        .doc =
            "a tolerance for steps of a fixed size: the method takes them in parts or several at once, as long as "
            "steps by tolerance would be; of the way of a coordinate, where that is below 1, unless the method damps "
            "stiff modes"};
}

}  // namespace delassus
