// SPDX-License-Identifier: BSD-3-Clause
#include "row_scaling.hpp"

#include "delassus/sdk/saddle_point.hpp"

namespace delassus::admm {

void RowScaling::analyze(const sdk::ProblemView& problem) {
    definite_ = !problem.needs_any(DELASSUS_CAN_H_SEMIDEFINITE);
    if (definite_) N_.analyze(problem);
}

void RowScaling::factorize(const sdk::ProblemView& problem) {
    if (definite_) {
        N_.factorize(problem);
        diagonal_ = N_.diagonal();
    } else {
        stand_in_ = sdk::magnitude_of_diagonal(problem);
        diagonal_ = sdk::stand_in_diagonal(problem, stand_in_);
    }
    scale_ = scale_of(problem.cones, diagonal_);
}

sdk::Vector RowScaling::free_velocity(const sdk::ProblemView& problem) const {
    if (definite_) return N_.free_velocity(problem);
    sdk::Vector r = problem.b;
    r.noalias() += problem.D * problem.a.cwiseQuotient(stand_in_).eval();
    return r;
}

}  // namespace delassus::admm
