// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>

#include "sweeps.hpp"

namespace {
std::int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                   double* lambda, delassus_outcome* outcome) {
    fixture::original().solve(solver, problem, request, x, lambda, outcome);
    return outcome->status = 1234;
}
}  // namespace

FIXTURE_PLUGIN("unknown_status", "returns a status that does not exist", descriptor.solve = solve)
