// SPDX-License-Identifier: BSD-3-Clause
// PT-Scotch through the module delassus_scotch.
#pragma once

#include <cstdint>
#include <vector>

namespace delassus {

/// A graph of which each process has a range of the vertices.
struct VertexRange {
    std::int64_t vertices_all = 0;
    std::vector<std::int64_t> start = {0};  ///< own vertices + 1, into neighbour
    std::vector<std::int64_t> neighbour;  ///< numbers through all processes, ascending for each vertex, without itself
    std::vector<std::int64_t> edge_weight;  ///< one for each neighbour, ≥ 1
    std::vector<std::int64_t> weight;       ///< of the own vertices, ≥ 1
};

}  // namespace delassus

// The module is built together with the library, so C++ types may cross here. part[k] ← the process of own vertex k.
// The graph's arrays are freed as they are copied. Throws InputError on all processes.
extern "C" {
using DelassusScotch = void (*)(std::int32_t communicator, delassus::VertexRange& graph,
                                std::vector<std::int32_t>& part);
}
