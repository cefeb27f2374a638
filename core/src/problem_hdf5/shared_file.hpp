// SPDX-License-Identifier: BSD-3-Clause
// An HDF5 file that the processes of a run write one after another.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "delassus/partitioned_files.hpp"
#include "hdf5/hdf5.hpp"
#include "support/atomic_file.hpp"

namespace delassus::problem_hdf5 {

/// The file while one process has it open. Throws InputError if HDF5 fails.
class Writing {
public:
    /// Creates the file, or opens it; target: its name for messages.
    Writing(const std::filesystem::path& file, bool create, std::string target);
    ~Writing();
    Writing(const Writing&) = delete;
    Writing& operator=(const Writing&) = delete;

    void text(const char* name, const std::string& value);       ///< attribute; nothing for an empty text
    void integer(const char* name, std::int64_t value);          ///< attribute
    void long_text(const char* name, const std::string& value);  ///< dataset of one text; nothing for an empty one
    void group(const char* name);
    /// A dataset of one dimension without values yet; its place on disk is set aside.
    void create(const char* name, hid_t type, std::int64_t count);
    void put(const char* name, std::int64_t first, std::span<const std::int64_t> values);
    void put(const char* name, std::int64_t first, std::span<const double> values);
    /// Closes the file; a full disk shows here at the latest.
    void close();
    [[nodiscard]] std::int64_t bytes() const { return bytes_; }

private:
    void put(const char* name, std::int64_t first, std::size_t count, hid_t type, const void* values);
    void check(bool good) const;

    std::string target_;
    hid_t file_;
    std::int64_t bytes_ = 0;
};

/// Process 0 lays the file out under a temporary name, each process writes, process 0 gives it its name. Collective.
void write_in_turn(const Communicator& communicator, const std::filesystem::path& path,
                   const std::function<void(Writing&)>& lay_out, const std::function<void(Writing&)>& write_own,
                   FileTraffic& traffic);

}  // namespace delassus::problem_hdf5
