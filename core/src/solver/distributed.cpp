// SPDX-License-Identifier: BSD-3-Clause

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

int process_count() {
    return first_number({"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MV2_COMM_WORLD_SIZE"}, 1);
}
int process_rank() {
    return first_number({"OMPI_COMM_WORLD_RANK", "PMI_RANK", "MV2_COMM_WORLD_RANK"}, 0);
}

}  // namespace delassus
