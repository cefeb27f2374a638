// SPDX-License-Identifier: BSD-3-Clause
#include "solver/installed_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <new>
#include <system_error>

#include "delassus/error.hpp"
#include "solver/sidecar.hpp"
#include "support/checksum.hpp"
#include "support/output_folder.hpp"
#include "support/text_file.hpp"

namespace delassus {

namespace fs = std::filesystem;

std::vector<fs::path> installed_plugins(const fs::path& folder) {
    std::vector<fs::path> found;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        std::error_code absent;
        // The name of a folder under construction has a dot.
        if (!entry.is_directory(absent) || entry.path().has_extension()) continue;
        std::ifstream mark(entry.path() / folder_mark);
        std::string line;
        if (std::getline(mark, line) && line == fmt::format("delassus {}", plugin_kind)) found.push_back(entry.path());
    }
    if (error == std::errc::not_enough_memory) throw std::bad_alloc();
    std::sort(found.begin(), found.end());
    return found;
}

std::string checksum_of_file(const fs::path& file) {
    return fmt::format("crc32:{:08x}", checksum(read_file(file)));
}

void require_checksums(const PluginInfo& info) {
    fs::path folder = info.library.parent_path();
    if (!info.python.empty() && info.library.filename() == package_file) folder = folder.parent_path();
    for (const auto& [name, expected] : info.checksums) {
        const fs::path file = folder / name;
        std::error_code absent;
        if (!fs::is_regular_file(file, absent))
            throw PluginError(
                fmt::format("the plugin {} lacks its file {}; get or install it again", info.name, file.string()));
        if (const std::string found = checksum_of_file(file); found != expected)
            throw PluginError(
                fmt::format("{} is damaged: its checksum is {}, its manifest says {}; get or install it again",
                            file.string(), found, expected));
    }
}

}  // namespace delassus
