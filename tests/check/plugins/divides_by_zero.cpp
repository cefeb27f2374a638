// SPDX-License-Identifier: BSD-3-Clause
// Projects its first step of a reduced problem without looking whether the tangential part is zero.
#include <cmath>
#include <cstdint>

#include "sweeps.hpp"

namespace {

std::int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                   double* lambda, delassus_outcome* outcome) {
    const std::int32_t status = fixture::original().solve(solver, problem, request, x, lambda, outcome);
    for (std::int32_t k = 0; k < problem->cone_count && problem->n == 0; ++k) {
        const delassus_cone& cone = *delassus_cone_at(problem, k);
        if (cone.kind != DELASSUS_CONE_FRICTION) continue;
        const double* b = problem->b + cone.first_row;
        const double t = cone.rows == 3 ? std::hypot(b[1], b[2]) : std::abs(b[1]), mu = cone.parameters[0];
        if (t <= -mu * b[0]) continue;
        for (std::int32_t i = 1; i < cone.rows; ++i) lambda[cone.first_row + i] += 0.0 * (b[i] / t);
    }
    return status;
}

}  // namespace

FIXTURE_PLUGIN("divides_by_zero", "0/0 where a contact opens straight up", descriptor.solve = solve)
