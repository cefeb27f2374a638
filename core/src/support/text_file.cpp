// SPDX-License-Identifier: BSD-3-Clause
#include "support/text_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "delassus/error.hpp"

namespace delassus {

std::string read_file(const std::filesystem::path& path) {
    std::error_code error;
    const auto status = std::filesystem::status(path, error);
    if (!std::filesystem::exists(status)) throw InputError(fmt::format("{}: there is no such file.", path.string()));
    if (!std::filesystem::is_regular_file(status)) {
        throw InputError(fmt::format("{} is not a regular file.", path.string()));
    }
    const auto close = [](std::FILE* file) { std::fclose(file); };
    const std::unique_ptr<std::FILE, decltype(close)> file(std::fopen(path.c_str(), "rb"), close);
    if (!file) throw InputError(fmt::format("{} cannot be opened: {}.", path.string(), std::strerror(errno)));
    std::string content;
    const auto size = std::filesystem::file_size(path, error);
    content.resize(error ? 0 : static_cast<std::size_t>(size) + 1);
    std::size_t held = 0;
    for (;;) {
        if (held == content.size()) content.resize(2 * content.size() + 4096);
        const std::size_t got = std::fread(content.data() + held, 1, content.size() - held, file.get());
        if (got == 0) break;
        held += got;
    }
    if (std::ferror(file.get()) != 0) {
        throw InputError(fmt::format("{} cannot be read: {}.", path.string(), std::strerror(errno)));
    }
    content.resize(held);
    return content;
}

}  // namespace delassus
