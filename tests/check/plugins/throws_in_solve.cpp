// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <stdexcept>

#include "sweeps.hpp"

namespace {
std::int32_t solve(void*, const delassus_problem*, const delassus_request*, double*, double*, delassus_outcome*) {
    throw std::runtime_error("thrown in solve");
}
}  // namespace

FIXTURE_PLUGIN("throws_in_solve", "throws through the border", descriptor.solve = solve)
