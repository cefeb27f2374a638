// SPDX-License-Identifier: BSD-3-Clause
// The module delassus_scotch: parts of a graph by PT-Scotch, through PETSc.
#include <fmt/format.h>
#include <petscmat.h>

#include <algorithm>
#include <limits>
#include <type_traits>

#include "delassus/error.hpp"
#include "delassus/export.hpp"
#include "library.hpp"
#include "partitioned/scotch_module.hpp"

namespace delassus {

namespace {

using petsc::check;

/// MatCreateMPIAdj and MatPartitioning own what they are given, and free it. Frees the values.
PetscInt* given(std::vector<std::int64_t>& values) {
    PetscInt* copy = nullptr;
    check(PetscMalloc1(values.size(), &copy));
    std::transform(values.begin(), values.end(), copy, [](std::int64_t value) { return static_cast<PetscInt>(value); });
    std::vector<std::int64_t>().swap(values);
    return copy;
}

void partition(MPI_Comm communicator, VertexRange& graph, std::vector<std::int32_t>& part) {
    std::int64_t largest =
        std::max<std::int64_t>(graph.vertices_all, static_cast<std::int64_t>(graph.neighbour.size()));
    MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_INT64_T, MPI_MAX, communicator);
    if (largest > std::numeric_limits<PetscInt>::max())
        throw InputError(
            fmt::format("the graph of bodies has {} vertices, or edges on one process, more than this "
                        "PETSc can number; keep the order of the file",
                        largest));
    int processes = 0;
    MPI_Comm_size(communicator, &processes);
    petsc::ensure_petsc();
    const petsc::Session session;
    const auto own = static_cast<PetscInt>(graph.weight.size());
    Mat adjacency = nullptr;
    check(MatCreateMPIAdj(communicator, own, static_cast<PetscInt>(graph.vertices_all), given(graph.start),
                          given(graph.neighbour), given(graph.edge_weight), &adjacency));
    MatPartitioning partitioning = nullptr;
    check(MatPartitioningCreate(communicator, &partitioning));
    check(MatPartitioningSetAdjacency(partitioning, adjacency));
    check(MatPartitioningSetType(partitioning, MATPARTITIONINGPTSCOTCH));
    check(MatPartitioningSetVertexWeights(partitioning, given(graph.weight)));
    check(MatPartitioningSetUseEdgeWeights(partitioning, PETSC_TRUE));
    check(MatPartitioningSetNParts(partitioning, processes));
    IS process = nullptr;
    check(MatPartitioningApply(partitioning, &process));
    const PetscInt* numbers = nullptr;
    check(ISGetIndices(process, &numbers));
    part.assign(numbers, numbers + own);
    check(ISRestoreIndices(process, &numbers));
    check(ISDestroy(&process));
    check(MatPartitioningDestroy(&partitioning));
    check(MatDestroy(&adjacency));
}

}  // namespace
}  // namespace delassus

extern "C" DELASSUS_API void delassus_scotch(std::int32_t communicator, delassus::VertexRange& graph,
                                             std::vector<std::int32_t>& part) {
    try {
        delassus::partition(MPI_Comm_f2c(communicator), graph, part);
    } catch (const delassus::InputError&) {
        throw;
    } catch (const std::exception& error) {
        throw delassus::InputError(fmt::format("PT-Scotch cannot partition the problem: {}", error.what()));
    }
}

static_assert(std::is_same_v<decltype(&delassus_scotch), DelassusScotch>);
