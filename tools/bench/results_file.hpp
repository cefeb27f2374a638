// SPDX-License-Identifier: BSD-3-Clause
// results.jsonl: one line of JSON for each thing that was found out, written as it is found out.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bench/json_text.hpp"
#include "support/output_folder.hpp"

namespace delassus::bench {

/// What a results file holds, as of its last session: rows that this session did not ask for are left out, and of rows
/// with the same key the last counts.
struct ResultSet {
    Json session;                                               ///< the last; null if the file holds none
    std::vector<Json> problems, references, libraries;          ///< of all sessions, the last of the same name
    std::vector<Json> scenes;                                   ///< with their plans
    std::vector<Json> axes;                                     ///< that the session's cells are of
    std::vector<Json> solves, simulations, leaving_out, cells;  ///< in the order of the session's keys
    std::size_t missing = 0;                                    ///< keys without a row: the session was interrupted
};

/// Throws InputError if the folder has no results.jsonl, or one of another format or version. A last line that is
/// incomplete is dropped.
[[nodiscard]] ResultSet read_results(const std::filesystem::path& folder);

/// How the run of a solver ended, as its row says.
struct RunEnd {
    std::string status, cause;  ///< cause: empty if solved
    bool skipped = false;       ///< it was not run, as it had failed at a looser tolerance
};

/// The folder of `delassus bench run`, for writing into.
[[nodiscard]] OutputFolder open_results(const std::filesystem::path& folder);

/// Appends rows; a row is in the file when add() returns.
class ResultsFile {
public:
    /// Opens or creates the file, cuts an incomplete last line off, and notes what is there. Throws InputError on a
    /// file of another format or version.
    explicit ResultsFile(OutputFolder& folder);

    [[nodiscard]] bool has(const std::string& key) const { return ends_.contains(key); }
    /// Of the last row with that key, which there must be.
    [[nodiscard]] const RunEnd& end_of(const std::string& key) const { return ends_.at(key); }
    void add(const Json& row);

private:
    void note(const Json& row);

    OutputFolder& folder_;
    std::filesystem::path file_;
    std::map<std::string, RunEnd> ends_;
};

}  // namespace delassus::bench
