// SPDX-License-Identifier: BSD-3-Clause
#include <csignal>
#include <cstdint>

#include "sweeps.hpp"

namespace {
std::int32_t solve(void*, const delassus_problem*, const delassus_request*, double*, double*, delassus_outcome*) {
    std::raise(SIGSEGV);
    return DELASSUS_ERROR;
}
}  // namespace

FIXTURE_PLUGIN("crashes_in_solve", "ends in a segmentation fault", descriptor.solve = solve)
