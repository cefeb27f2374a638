// SPDX-License-Identifier: BSD-3-Clause
// Writes one number beyond the end of λ.
#include <cstdint>

#include "sweeps.hpp"

namespace {
std::int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                   double* lambda, delassus_outcome* outcome) {
    const auto status = fixture::original().solve(solver, problem, request, x, lambda, outcome);
    // Where nobody listens: the suite's own vectors, which have guards, and never the heap of the host.
    if (!request->progress) lambda[problem->m] = 1.0;
    return status;
}
}  // namespace

FIXTURE_PLUGIN("writes_beyond", "writes beyond the end of a vector", descriptor.solve = solve)
