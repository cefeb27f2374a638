// SPDX-License-Identifier: BSD-3-Clause
// Throws its analysis away before every right-hand side.
#include <cstdint>

#include "sweeps.hpp"

namespace {
std::int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                   double* lambda, delassus_outcome* outcome) {
    fixture::original().analyze(solver, problem);
    fixture::original().factorize(solver, problem);
    return fixture::original().solve(solver, problem, request, x, lambda, outcome);
}
}  // namespace

FIXTURE_PLUGIN("analyzes_always", "reuses nothing", descriptor.solve = solve)
