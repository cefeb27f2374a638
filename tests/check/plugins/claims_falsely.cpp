// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>

#include "sweeps.hpp"

namespace {
std::int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                   double* lambda, delassus_outcome* outcome) {
    fixture::original().solve(solver, problem, request, x, lambda, outcome);
    std::fill_n(x, problem->n, 0.0);
    std::fill_n(lambda, problem->m, 0.0);
    outcome->residual = 1e-16;
    return outcome->status = DELASSUS_SOLVED;
}
}  // namespace

FIXTURE_PLUGIN("claims_falsely", "says that it solved what it did not", descriptor.solve = solve)
