// SPDX-License-Identifier: BSD-3-Clause
// A problem of which each process of a run holds a part (docs/partitioned.md).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "delassus/communicator.hpp"
#include "delassus/export.hpp"
#include "delassus/problem.hpp"

namespace delassus {

/// Own rows of a matrix by compressed rows; columns are numbered through all processes, ascend within a row and do not
/// repeat. A default-constructed one is 0 × 0 and counts as absent.
struct LocalMatrix {
    std::int64_t rows = 0;     ///< own
    std::int64_t columns = 0;  ///< of all processes
    std::vector<std::int64_t> row_start = {0};
    std::vector<std::int64_t> column;
    std::vector<double> value;

    [[nodiscard]] std::int64_t entries() const { return static_cast<std::int64_t>(value.size()); }
};

/// The own part of a problem by value. A process owns whole bodies (their rows of H, a and x) and whole cones (their
/// rows of D, E, b and λ), each a contiguous range of the numbers through all processes; it may own nothing.
struct PartitionedProblem {
    std::string name;
    Law law = Law::Associated;
    std::string source;  ///< where it came from
    std::string notes;   ///< anything odd

    /// Process p owns the numbers start[p] … start[p + 1] − 1; processes + 1 entries, the same on all.
    std::vector<std::int64_t> column_start = {0, 0}, row_start = {0, 0}, cone_start = {0, 0};

    LocalMatrix H;            ///< n × n_all, both triangles
    LocalMatrix D;            ///< m × n_all
    LocalMatrix E;            ///< m × m_all, both triangles; 0 × 0 if absent on all processes
    std::vector<double> a;    ///< n
    std::vector<double> b;    ///< m
    std::vector<Cone> cones;  ///< in the order of the own rows; together m rows

    /// The first column of each own body, ascending, among the numbers of all processes; empty where nobody said it.
    std::vector<std::int64_t> body_start;

    /// The numbers that the own entries of x, and of λ, had before a partition moved them: in the file, or in the
    /// generator. Empty where they are the numbers of today.
    std::vector<std::int64_t> column_origin, row_origin;

    [[nodiscard]] std::int64_t n() const { return static_cast<std::int64_t>(a.size()); }
    [[nodiscard]] std::int64_t m() const { return static_cast<std::int64_t>(b.size()); }
    [[nodiscard]] std::int64_t n_all() const { return column_start.back(); }
    [[nodiscard]] std::int64_t m_all() const { return row_start.back(); }
};

/// The part of this process of a problem that every process holds as a whole: ranges of bodies (connected blocks of H
/// where they are small, else single columns) and of cones with about as many rows of H, or of D, on each process, in
/// the order of the problem. Takes what it keeps. Throws InputError as validate() does. Collective.
[[nodiscard]] DELASSUS_API PartitionedProblem part_of(const Communicator& communicator, Problem problem);

/// The whole problem on every process, for tests and small problems. Collective.
[[nodiscard]] DELASSUS_API Problem gathered(const Communicator& communicator, const PartitionedProblem& part);

/// Checks the own part (shapes, indices, finiteness, cone parameters, starts equal on all processes) and, across
/// processes, that E is symmetric. Throws InputError with one sentence, on all processes. Collective.
DELASSUS_API void validate(const Communicator& communicator, const PartitionedProblem& problem);

}  // namespace delassus
