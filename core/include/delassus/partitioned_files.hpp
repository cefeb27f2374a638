// SPDX-License-Identifier: BSD-3-Clause
// Problems and solutions in one HDF5 file, of which each process of a run reads and writes its slice (docs/files.md).
// HDF5 is loaded by the first such file. All functions with a communicator are collective, and throw on all processes
// or on none: InputError with one sentence that names the file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "delassus/communicator.hpp"
#include "delassus/export.hpp"
#include "delassus/needs.hpp"
#include "delassus/partitioned.hpp"

namespace delassus {

/// What one process moved between memory and the file.
struct FileTraffic {
    std::int64_t bytes_read = 0;     ///< of datasets, as they are stored without compression
    std::int64_t bytes_written = 0;  ///< likewise
};

/// Whether the path is a file that says it is a problem of this form (an HDF5 file whose attribute `format` is
/// "delassus-problem"). Reads little and loads HDF5 only for files that begin as HDF5 files do.
[[nodiscard]] DELASSUS_API bool is_partitioned_file(const std::filesystem::path& path);

/// The own part: contiguous ranges of the file's bodies and cones, with about as many rows of H and D on each process.
/// A cone goes with the body of its smallest column where the file's cones are in that order; otherwise each process
/// gets an even share of the rows. What is read is validated.
[[nodiscard]] DELASSUS_API PartitionedProblem read_partitioned(const Communicator& communicator,
                                                               const std::filesystem::path& path,
                                                               FileTraffic* traffic = nullptr);

/// Writes the problem in the order of its numbers of today, one process after another. The file appears whole or not at
/// all, and replaces one of that name.
DELASSUS_API void write_partitioned(const Communicator& communicator, const PartitionedProblem& part,
                                    const std::filesystem::path& path, FileTraffic* traffic = nullptr);

/// Writes x and λ, own parts of the sizes n and m, in the order that the problem had before it was moved
/// (column_origin, row_origin), and the report, which process 0 gives; it may be empty. As write_partitioned.
DELASSUS_API void write_partitioned_solution(const Communicator& communicator, const std::filesystem::path& path,
                                             const PartitionedProblem& part, const std::vector<double>& x,
                                             const std::vector<double>& lambda, const std::string& report_json,
                                             FileTraffic* traffic = nullptr);

/// The own part of x and λ, as a start. Refuses a solution of another size.
[[nodiscard]] DELASSUS_API Solution read_partitioned_solution(const Communicator& communicator,
                                                              const std::filesystem::path& path,
                                                              const PartitionedProblem& part,
                                                              FileTraffic* traffic = nullptr);

/// What a problem's file holds.
struct PartitionedFileSummary {
    struct Cones {
        std::int64_t blocks = 0, rows = 0;
    };
    std::string name, source, notes;
    Law law = Law::Associated;
    std::int64_t n = 0, m = 0, cone_count = 0;
    std::int64_t body_count = 0;  ///< 0 where the file does not say it
    std::int64_t H_entries = 0, D_entries = 0, E_entries = 0;
    std::map<std::string, Cones> cones;  ///< by the name of their kind
    /// Diagonal and Blocks are certain (small blocks, each of them definite); so are Reduced, Unsymmetric and
    /// Indefinite. Definite means: larger blocks, symmetric with a positive diagonal; nobody has factored it.
    Structure structure = Structure::Reduced;
    std::int64_t largest_block = 0;  ///< rows, where the structure is Diagonal or Blocks
    std::int64_t file_bytes = 0;
};

/// Reads the cones and H, in pieces of bounded size, each process its share; never D. Collective.
[[nodiscard]] DELASSUS_API PartitionedFileSummary inspect_partitioned(const Communicator& communicator,
                                                                      const std::filesystem::path& path);

}  // namespace delassus
