// SPDX-License-Identifier: BSD-3-Clause
#include "interior_point.hpp"

namespace {

using delassus::sdk::choice_option;
using delassus::sdk::integer_option;
using delassus::sdk::real_option;

constexpr const char* preconditioners[] = {"auto", "mumps", "schwarz", "bjacobi", "hypre"};

constexpr delassus_option options[] = {
    choice_option(
        "preconditioner", "auto", preconditioners,
        "of H + D'TD: Cholesky factors by MUMPS, or conjugate gradients with the factors of overlapping domains "
        "(schwarz), incomplete Cholesky on each process, or hypre's BoomerAMG; auto: mumps up to 500 000 columns "
        "a process, then schwarz"),
    integer_option("subdomain", "3000", 1, 1e9, "columns", "of the domains of schwarz, before they overlap"),
    integer_option("overlap", "2", 0, 100, "layers", "of bodies by which the domains of schwarz grow"),
    integer_option("inner_iterations", "2000", 1, 1e9, "iterations", "of conjugate gradients in one linear solve"),
    integer_option("correctors", "3", 0, 100, "", "largest number of Gondzio's correctors of a step, with mumps"),
    real_option("step_fraction", "0.99", 0.5, 0.9999, "", "part of the way to the boundary that a step may take"),
    real_option("regularization", "1e-13", 1e-15, 1e-4, "",
                "static regularisation of the rows, relative to the diagonal of N; refinement removes its effect"),
    integer_option("refinements", "3", 0, 100, "", "largest number of refinements of a linear solve"),
    integer_option("stall_iterations", "15", 0, 1e9, "iterations",
                   "give up after this many iterations without an improvement by 1 %; 0: never"),
};

constexpr delassus::sdk::PluginInfo info{
    .name = "ipm_petsc",
    .version = "0.1.0",
    .description = "interior point method for problems in parts, on PETSc's Krylov methods and factors under MPI",
    .licence = "BSD-3-Clause AND BSD-2-Clause AND CECILL-C AND GPL-2.0-or-later",
    .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_BOX | DELASSUS_CAN_FRICTION |
                    DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                    DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT |
                    DELASSUS_CAN_WARM_START | DELASSUS_CAN_PARTITIONED,
    .flags = DELASSUS_FLAG_MPI,
};

}  // namespace

DELASSUS_SOLVER_PLUGIN(delassus::petsc::PartitionedInteriorPoint, info, options)
