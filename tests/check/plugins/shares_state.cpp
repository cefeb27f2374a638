// SPDX-License-Identifier: BSD-3-Clause
// All solvers share one factorisation: two at once disturb each other.
#include <cstdint>

#include "sweeps.hpp"

namespace {
const void* owner = nullptr;

std::int32_t factorize(void* solver, const delassus_problem* problem) {
    owner = solver;
    return fixture::original().factorize(solver, problem);
}

std::int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                   double* lambda, delassus_outcome* outcome) {
    const auto status = fixture::original().solve(solver, problem, request, x, lambda, outcome);
    for (std::int32_t i = 0; owner != solver && i < problem->n; ++i) x[i] *= 2.0;
    return status;
}
}  // namespace

FIXTURE_PLUGIN("shares_state", "keeps one state for all solvers", descriptor.factorize = factorize;
               descriptor.solve = solve)
