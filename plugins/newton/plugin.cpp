// SPDX-License-Identifier: BSD-3-Clause
#include "newton.hpp"

namespace {

constexpr delassus_option options[] = {
    delassus::sdk::integer_option("stall_iterations", "250", 0, 1e9, "iterations",
                                  "give up after this many iterations without a smaller error; 0: never"),
};

constexpr delassus::sdk::PluginInfo info{
    .name = "newton",
    .version = "0.1.0",
    .description = "Newton's method on the velocities, where every row has compliance",
    .licence = "BSD-3-Clause",
    .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_BOX | DELASSUS_CAN_FRICTION |
                    DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                    DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_WARM_START,
};

}  // namespace

DELASSUS_SOLVER_PLUGIN(delassus::newton::VelocityNewton, info, options)
