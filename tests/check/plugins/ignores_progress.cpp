// SPDX-License-Identifier: BSD-3-Clause
// Calls progress, and goes on whatever it answers.
#include <cstdint>

#include "sweeps.hpp"

namespace {
std::int32_t deaf(void* context, std::int64_t iteration, const double* x, const double* lambda) {
    const auto& request = *static_cast<const delassus_request*>(context);
    request.progress(request.progress_context, iteration, x, lambda);
    return DELASSUS_CONTINUE;
}

std::int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                   double* lambda, delassus_outcome* outcome) {
    delassus_request listened = *request;
    delassus_request changed = *request;
    if (request->progress) {
        changed.progress = deaf;
        changed.progress_context = &listened;
    }
    return fixture::original().solve(solver, problem, &changed, x, lambda, outcome);
}
}  // namespace

FIXTURE_PLUGIN("ignores_progress", "does not stop when told to", descriptor.solve = solve)
