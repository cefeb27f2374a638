// SPDX-License-Identifier: BSD-3-Clause
#include "ssn.hpp"

namespace {

using delassus::sdk::boolean_option;
using delassus::sdk::choice_option;
using delassus::sdk::integer_option;

constexpr const char* forms[] = {"auto", "rows", "velocities"};

constexpr delassus_option options[] = {
    choice_option("form", "auto", forms,
                  "unknowns of the Newton system; auto: velocities where they are fewer than rows"),
    boolean_option("follow_law", true,
                   "where exact Coulomb stalls, start from the associated law's solution and follow it"),
    integer_option("stall_iterations", "300", 0, 1e9, "iterations",
                   "give up after this many iterations that did not lower the error by a tenth; 0: never"),
};

constexpr delassus::sdk::PluginInfo info{
    .name = "ssn",
    .version = "0.1.0",
    .description = "proximal semismooth Newton on the natural map, for both friction laws",
    .licence = "BSD-3-Clause AND MPL-2.0",
    .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_BOX | DELASSUS_CAN_FRICTION |
                    DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_COULOMB | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                    DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_REDUCED | DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT |
                    DELASSUS_CAN_WARM_START,
    .flags = DELASSUS_FLAG_LOCAL | DELASSUS_FLAG_RESUMES,
};

}  // namespace

DELASSUS_SOLVER_PLUGIN(delassus::ssn::SemismoothNewton, info, options)
