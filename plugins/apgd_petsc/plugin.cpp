// SPDX-License-Identifier: BSD-3-Clause
#include "apgd.hpp"

namespace {

using delassus::sdk::boolean_option;
using delassus::sdk::integer_option;
using delassus::sdk::real_option;

constexpr delassus_option options[] = {
    real_option("step_growth", "1.02", 1.0, 2.0, "", "factor by which the step grows after each iteration"),
    real_option("step_shrinkage", "0.9", 0.1, 0.999, "", "largest factor by which backtracking cuts the step"),
    boolean_option("restart", true, "drop the momentum where it points uphill"),
    integer_option("stall_iterations", "100000", 0, 1e9, "iterations",
                   "give up after this many iterations without an improvement by 1 %; 0: never"),
};

constexpr delassus::sdk::PluginInfo info{
    .name = "apgd_petsc",
    .version = "0.1.0",
    .description = "accelerated projected gradient for problems in parts, on PETSc under MPI",
    .licence = "BSD-3-Clause AND BSD-2-Clause AND CECILL-C AND GPL-2.0-or-later",
    .capabilities = delassus::sdk::all_cones | DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_H_DIAGONAL |
                    DELASSUS_CAN_H_BLOCKS | DELASSUS_CAN_REDUCED | DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT |
                    DELASSUS_CAN_WARM_START | DELASSUS_CAN_PARTITIONED,
    .flags = DELASSUS_FLAG_MPI,
};

}  // namespace

DELASSUS_SOLVER_PLUGIN(delassus::petsc::PartitionedGradient, info, options)
