// SPDX-License-Identifier: BSD-3-Clause
// What this program writes says so, and only that is ever replaced or removed. A folder has a file .delassus: a line
// "delassus KIND", then the names of what was written into it, one a line, folders with a slash at the end. A file has
// the words `written by delassus` within its first kilobytes.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/export.hpp"

namespace delassus {

inline constexpr std::string_view folder_mark = ".delassus";
inline constexpr std::string_view file_mark = "written by delassus";

/// The text of a file that people may edit: `comment` begins a first line with the mark and a checksum of the rest.
/// An edited one is the user's own.
DELASSUS_API std::string marked_text(std::string_view comment, const std::string& text);

/// Throws InputError if the path is there and this program did not write it, or if it is a folder that holds more than
/// that. kind: of a folder, e.g. "problem", and of the folders in it. An empty folder may be replaced.
DELASSUS_API void require_replaceable(const std::filesystem::path& path, std::string_view kind);

/// Writes the mark of a folder with these names in it.
DELASSUS_API void write_folder_mark(const std::filesystem::path& folder, std::string_view kind,
                                    const std::vector<std::string>& names);

/// Adds a name to the mark of the folder, if it has one: of a file that is written beside the folder's own.
DELASSUS_API void add_to_folder_mark(const std::filesystem::path& folder, const std::string& name);

/// A folder that a command fills, file by file. While this lives, no other process gets the folder. What is written
/// into a new or cleared folder disappears again unless keep() is called.
class DELASSUS_API OutputFolder {
public:
    /// Makes the folder, or opens one that this kind of command has filled before. Throws InputError if it is anything
    /// else but empty, or if another process is writing into it.
    /// adopted: names that are of this kind of command where an older version has left no mark.
    OutputFolder(std::filesystem::path folder, std::string kind, const std::vector<std::string>& adopted = {});
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;
    ~OutputFolder();

    [[nodiscard]] const std::filesystem::path& path() const { return folder_; }

    /// Removes all that was written into it before.
    void clear();

    /// The place for a file or a folder with a mark of its own, which may be in a folder of add_folder(). Throws
    /// InputError if something is there that this program did not write.
    std::filesystem::path add(const std::string& name);
    /// Makes the folder in it.
    std::filesystem::path add_folder(const std::string& name);
    /// Writes the file, whole or not at all.
    void write(const std::string& name, std::string_view content);
    /// Removes the file if it was written before.
    void remove(const std::string& name);

    void keep() { kept_ = true; }

private:
    void lock(const std::vector<std::string>& adopted);
    void list(const std::string& line);

    std::filesystem::path folder_;
    std::string kind_;
    std::set<std::string> names_;
    int lock_ = -1;
    bool made_ = false;  ///< the folder itself
    bool kept_ = true;
};

}  // namespace delassus
