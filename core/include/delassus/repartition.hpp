// SPDX-License-Identifier: BSD-3-Clause
// Moving bodies and cones among processes (docs/partitioned.md).
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "delassus/communicator.hpp"
#include "delassus/export.hpp"
#include "delassus/partitioned.hpp"

namespace delassus {

/// How well a problem is shared among the processes.
struct PartitionQuality {
    std::int64_t cones = 0;        ///< of all processes
    std::int64_t cut_cones = 0;    ///< that have to do with columns of more than one process
    std::int64_t ghosts = 0;       ///< columns of others that the rows of a process have to do with, over all processes
    std::int64_t most_ghosts = 0;  ///< of one process
    double imbalance = 1.0;        ///< the largest part of columns and rows together over the mean; 1 is even
};

/// Collective.
[[nodiscard]] DELASSUS_API PartitionQuality measure_partition(const Communicator& communicator,
                                                              const PartitionedProblem& problem);

enum class Partitioning {
    Automatic,  ///< FileOrder where that cuts few cones, else Scotch: see chosen_partitioning()
    FileOrder,  ///< as it is
    Scotch      ///< PT-Scotch, through PETSc, on the graph of bodies weighted by their contacts
};
[[nodiscard]] DELASSUS_API Partitioning partitioning_of(std::string_view name);  ///< auto | file | scotch; InputError
[[nodiscard]] DELASSUS_API std::string_view name_of(Partitioning partitioning);

/// What Automatic stands for. A compact partition of B bodies in space among P processes cuts about c (B/P)^(2/3) P
/// contacts; the order is taken as it is up to twice that, and where it is not known to be worse than what Scotch could
/// do: with one process, or without cones.
[[nodiscard]] DELASSUS_API Partitioning chosen_partitioning(const Communicator& communicator,
                                                            const PartitionedProblem& problem);

/// The problem with whole bodies moved so that few cones are cut and columns and rows are even; a cone goes to the
/// process that has most of its columns' bodies. column_origin and row_origin say where everything was before (before
/// the first move, if it was moved already). On each process bodies and cones keep their order. With one process, or
/// where nothing is to do, the problem itself. Throws InputError if this build cannot use PETSc with PT-Scotch.
/// Collective.
[[nodiscard]] DELASSUS_API PartitionedProblem repartition(const Communicator& communicator, PartitionedProblem problem,
                                                          Partitioning how = Partitioning::Automatic);

/// Moves each own body k to the process target[k]; one entry for each entry of bodies_of(). As repartition(). Beside
/// the part there stands at most its largest array once more, and some megabytes on their way. Collective.
[[nodiscard]] DELASSUS_API PartitionedProblem moved(const Communicator& communicator, PartitionedProblem problem,
                                                    const std::vector<std::int32_t>& target);

/// The first columns of the own bodies: body_start, or where nobody said it, the diagonal blocks of H of at most 16
/// columns (each column alone where there are none).
[[nodiscard]] DELASSUS_API std::vector<std::int64_t> bodies_of(const Communicator& communicator,
                                                               const PartitionedProblem& problem);

}  // namespace delassus
