// SPDX-License-Identifier: BSD-3-Clause
#include "admm.hpp"

namespace {

using delassus::sdk::boolean_option;
using delassus::sdk::choice_option;
using delassus::sdk::integer_option;
using delassus::sdk::real_option;

constexpr const char* accelerations[] = {"none", "anderson"};

constexpr delassus_option options[] = {
    real_option("rho", "1", 1e-6, 1e6, "", "penalty at the start, relative to the inverse of diag(N)"),
    real_option("over_relaxation", "1.6", 0.1, 1.99, "", "share of each step taken; 1 is the plain method"),
    boolean_option("adaptive_rho", true, "let the penalty follow the iterates, with a new factorisation each time"),
    choice_option("acceleration", "anderson", accelerations, "extrapolation of the iterates"),
    integer_option("memory", "10", 1, 100, "iterations", "differences that anderson keeps"),
    integer_option("stall_iterations", "20000", 0, 1e9, "iterations",
                   "give up after this many iterations without an improvement by 1 %; 0: never"),
};

constexpr delassus::sdk::PluginInfo info{
    .name = "admm_petsc",
    .version = "0.1.0",
    .description = "ADMM for problems in parts, for both friction laws, on factors by MUMPS through PETSc under MPI",
    .licence = "BSD-3-Clause AND BSD-2-Clause AND CECILL-C AND GPL-2.0-or-later",
    .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_BOX | DELASSUS_CAN_FRICTION |
                    DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_COULOMB | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                    DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT |
                    DELASSUS_CAN_WARM_START | DELASSUS_CAN_PARTITIONED,
    .flags = DELASSUS_FLAG_MPI,
};

}  // namespace

DELASSUS_SOLVER_PLUGIN(delassus::petsc::PartitionedAdmm, info, options)
