// SPDX-License-Identifier: BSD-3-Clause
#include "sweeps.hpp"

namespace {
constexpr delassus_option option = {"factor", DELASSUS_OPTION_REAL, 0, "1", 0.0, 1.0, nullptr, "", "a factor"};
constexpr delassus_option options[] = {option, option};
}  // namespace

FIXTURE_PLUGIN("duplicate_option", "an option twice", descriptor.options = options; descriptor.option_count = 2)
