// SPDX-License-Identifier: BSD-3-Clause

#include <algorithm>
#include <cstdlib>
#include <initializer_list>

#include "delassus/distributed.hpp"

namespace delassus {

namespace {

int first_number(std::initializer_list<const char*> variables, int otherwise) {
    for (const char* variable : variables)
        if (const char* text = std::getenv(variable)) return std::atoi(text);
    return otherwise;
}

}  // namespace

// PMIx, by which srun starts processes for Open MPI, tells a process its rank alone; their number is Slurm's. A batch
// script has Slurm's variables too, but no rank of PMIx.
int process_count() {
    const int slurm = std::getenv("PMIX_RANK") ? first_number({"SLURM_STEP_NUM_TASKS"}, 1) : 1;
    return first_number({"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MV2_COMM_WORLD_SIZE"}, std::max(slurm, 1));
}
int process_rank() {
    const int slurm = std::getenv("SLURM_STEP_NUM_TASKS") ? first_number({"PMIX_RANK"}, 0) : 0;
    return first_number({"OMPI_COMM_WORLD_RANK", "PMI_RANK", "MV2_COMM_WORLD_RANK"}, slurm);
}

}  // namespace delassus
