// SPDX-License-Identifier: BSD-3-Clause
// Calls progress for ever, whatever it answers.
#include <unistd.h>
#include <cstdint>

#include "sweeps.hpp"

namespace {
std::int32_t solve(void*, const delassus_problem*, const delassus_request* request, double*, double* lambda,
                   delassus_outcome*) {
    for (std::int64_t iteration = 0;; ++iteration) {
        if (request->progress) request->progress(request->progress_context, iteration, nullptr, lambda);
        usleep(1000);
    }
}
}  // namespace

FIXTURE_PLUGIN("hangs_with_progress", "never returns", descriptor.solve = solve)
