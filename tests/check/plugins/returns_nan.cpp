// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <limits>

#include "sweeps.hpp"

namespace {
std::int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                   double* lambda, delassus_outcome* outcome) {
    const auto status = fixture::original().solve(solver, problem, request, x, lambda, outcome);
    std::fill_n(x, problem->n, std::numeric_limits<double>::quiet_NaN());
    std::fill_n(lambda, problem->m, std::numeric_limits<double>::infinity());
    return status;
}
}  // namespace

FIXTURE_PLUGIN("returns_nan", "returns values that are not finite", descriptor.solve = solve)
