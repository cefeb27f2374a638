// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "delassus/repartition.hpp"

namespace delassus::command {

/// One line for people.
void print_quality(const PartitionQuality& quality, int processes);

/// Process 0 prints the peak memory of every process, where there are several. Collective.
void print_memory(const Communicator& run);

}  // namespace delassus::command
