// SPDX-License-Identifier: BSD-3-Clause
#include "interior_point.hpp"

namespace {

using delassus::sdk::choice_option;
using delassus::sdk::integer_option;

constexpr const char* forms[] = {"auto", "normal", "augmented"};

constexpr const char* paths[] = {"product", "shift"};

constexpr delassus_option options[] = {
    choice_option(
        "form", "auto", forms,
        "what is factored where n > 0: H + D'TD (if E couples no two cones), or the quasi-definite saddle point"),
    delassus::ipm::step_fraction_option,
    delassus::ipm::regularization_option,
    delassus::ipm::refinements_option,
    integer_option("stall_iterations", "15", 0, 1e9, "iterations",
                   "give up after this many iterations without an improvement by 1 % (exact Coulomb near the end: by "
                   "half); 0: never"),
    choice_option(
        "path", "product", paths,
        "exact Coulomb: the equation by which the start is left, the product of normal force and velocity, or "
        "the shift by the sliding speed"),
    integer_option("hops", "0", 0, 1e6, "",
                   "exact Coulomb: how often to look for a way on where the path to the solution ends"),
};

constexpr delassus::sdk::PluginInfo info{
    .name = "ipm",
    .version = "0.1.0",
    .description = "primal-dual interior point method with Nesterov-Todd scaling, for both friction laws",
    .licence = "BSD-3-Clause AND MPL-2.0",
    .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_BOX | DELASSUS_CAN_FRICTION |
                    DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_COULOMB | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                    DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_H_SEMIDEFINITE | DELASSUS_CAN_REDUCED |
                    DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT | DELASSUS_CAN_WARM_START,
    .flags = DELASSUS_FLAG_RESUMES,
};

}  // namespace

DELASSUS_SOLVER_PLUGIN(delassus::ipm::InteriorPoint, info, options)
