// SPDX-License-Identifier: BSD-3-Clause
// Never calls progress, never returns.
#include <unistd.h>
#include <cstdint>

#include "sweeps.hpp"

namespace {
std::int32_t solve(void*, const delassus_problem*, const delassus_request*, double*, double*, delassus_outcome*) {
    for (;;) usleep(1000);
}
}  // namespace

FIXTURE_PLUGIN("hangs", "never returns", descriptor.solve = solve)
