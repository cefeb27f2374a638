// SPDX-License-Identifier: BSD-3-Clause
#include "sweeps.hpp"

namespace {
constexpr delassus_option options[] = {{"factor", DELASSUS_OPTION_REAL, 0, "3", 0.0, 1.0, nullptr, "", "a factor"}};
}  // namespace

FIXTURE_PLUGIN("default_outside_range", "a default that its own range forbids", descriptor.options = options;
               descriptor.option_count = 1)
