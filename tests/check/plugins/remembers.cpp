// SPDX-License-Identifier: BSD-3-Clause
// Every second solve is sharper: as with a step length that is kept, an answer depends on the solves before it.
#include <cstdint>
#include <map>
#include <mutex>

#include "sweeps.hpp"

namespace {

std::mutex mutex;
std::map<void*, int> solves;

std::int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                   double* lambda, delassus_outcome* outcome) {
    delassus_request sharper = *request;
    {
        const std::lock_guard lock(mutex);
        if (solves[solver]++ % 2 == 1) sharper.tolerance *= 0.25;
    }
    return fixture::original().solve(solver, problem, &sharper, x, lambda, outcome);
}

void destroy(void* solver) {
    {
        const std::lock_guard lock(mutex);
        solves.erase(solver);
    }
    fixture::original().destroy(solver);
}

}  // namespace

FIXTURE_PLUGIN("remembers", "keeps its step length", descriptor.solve = solve; descriptor.destroy = destroy)
