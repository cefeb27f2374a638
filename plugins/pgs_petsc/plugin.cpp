// SPDX-License-Identifier: BSD-3-Clause
#include "options.hpp"
#include "pgs.hpp"

namespace {

using namespace delassus::pgs;

constexpr delassus_option options[] = {
    variant_option,      local_solver_option, omega_option,       ordering_option,
    acceleration_option, memory_option,       check_every_option, stall_window_option,
};

constexpr delassus::sdk::PluginInfo info{
    .name = "pgs_petsc",
    .version = "0.1.0",
    .description = "projected Gauss-Seidel for problems in parts, for both friction laws, on PETSc under MPI",
    .licence = "BSD-3-Clause AND BSD-2-Clause AND CECILL-C AND GPL-2.0-or-later",
    .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_BOX | DELASSUS_CAN_FRICTION |
                    DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_COULOMB | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                    DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT | DELASSUS_CAN_WARM_START |
                    DELASSUS_CAN_PARTITIONED,
    .flags = DELASSUS_FLAG_MPI,
};

}  // namespace

DELASSUS_SOLVER_PLUGIN(delassus::petsc::PartitionedGaussSeidel, info, options)
