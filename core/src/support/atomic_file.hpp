// SPDX-License-Identifier: BSD-3-Clause
// Files and folders that appear whole or not at all: written under a temporary name beside the target, then renamed.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "delassus/export.hpp"

namespace delassus {

/// Replaces or creates the file. If anything fails, what was there before stays, nothing is left beside it, and
/// InputError says why.
DELASSUS_API void write_file_atomically(const std::filesystem::path& path, std::string_view content);

/// The same with several files that belong together: none is replaced before all are written.
DELASSUS_API void write_files_atomically(const std::vector<std::pair<std::filesystem::path, std::string>>& contents);

/// Adds to the end of the file, or creates it; all or nothing. Throws InputError if that fails.
DELASSUS_API void append_to_file(const std::filesystem::path& path, std::string_view content);

/// Removes what writers of this target have left beside it that were ended before they could: on this machine.
DELASSUS_API void remove_leftovers(const std::filesystem::path& target);
/// The same of all targets in the folder that have such a name.
DELASSUS_API void remove_leftovers(const std::filesystem::path& folder,
                                   const std::function<bool(const std::string& name)>& is_target);

/// A file under construction: write() it, or let a library create path(); then commit(). A file that is not committed
/// disappears.
class DELASSUS_API AtomicFile {
public:
    /// Throws InputError if target is a folder or its parent is missing.
    explicit AtomicFile(std::filesystem::path target);
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;
    ~AtomicFile();

    /// The temporary name; nothing has it yet.
    [[nodiscard]] const std::filesystem::path& path() const { return temporary_; }

    /// Creates it with this content; throws InputError if that fails.
    void write(std::string_view content);

    /// Puts the file in its place; throws InputError and leaves the old one if that fails.
    void commit();

private:
    std::filesystem::path target_;
    std::filesystem::path temporary_;
};

/// Removes a folder that require_replaceable() of this kind lets pass: whole, or not at all. Throws InputError.
DELASSUS_API void remove_folder_atomically(const std::filesystem::path& folder, const std::string& kind);

/// A folder under construction. Fill path() with files and folders, then commit(); a folder that is not committed
/// disappears.
class DELASSUS_API AtomicFolder {
public:
    /// kind: of the folder's mark. A target that exists must satisfy require_replaceable().
    AtomicFolder(const std::filesystem::path& target, std::string kind);
    AtomicFolder(const AtomicFolder&) = delete;
    AtomicFolder& operator=(const AtomicFolder&) = delete;
    ~AtomicFolder();

    /// The temporary folder, empty at first.
    [[nodiscard]] const std::filesystem::path& path() const { return temporary_; }

    /// Puts the folder in its place; throws InputError and leaves the old one if that fails.
    void commit();

private:
    std::filesystem::path target_;
    std::filesystem::path temporary_;
    std::string kind_;
};

}  // namespace delassus
