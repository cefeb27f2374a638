// SPDX-License-Identifier: BSD-3-Clause
#include "support/text_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "delassus/error.hpp"

namespace delassus {

namespace {

struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, Close>;

/// Opened so that a pipe does not wait for a writer, and judged by what was opened.
File opened(const std::filesystem::path& path, struct stat& information) {
    const auto refuse = [&] {
        if (errno == ENOENT || errno == ENOTDIR)
            throw InputError(fmt::format("{}: there is no such file.", path.string()));
        throw InputError(fmt::format("{} cannot be opened: {}.", path.string(), std::strerror(errno)));
    };
    const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (descriptor < 0 && errno == ENXIO) throw InputError(fmt::format("{} is not a regular file.", path.string()));
    if (descriptor < 0) refuse();
    File file(fdopen(descriptor, "rb"));
    if (!file) {
        close(descriptor);
        refuse();
    }
    if (fstat(descriptor, &information) != 0) refuse();
    if (!S_ISREG(information.st_mode)) throw InputError(fmt::format("{} is not a regular file.", path.string()));
    return file;
}

}  // namespace

void require_regular_file(const std::filesystem::path& path) {
    struct stat information {};
    static_cast<void>(opened(path, information));
}

std::string read_file(const std::filesystem::path& path, std::uint64_t most) {
    struct stat information {};
    const File file = opened(path, information);
    const auto bytes = static_cast<std::uint64_t>(information.st_size);
    const auto refuse_size = [&] {
        throw InputError(fmt::format("{} has more than {} bytes, which no such file needs.", path.string(), most));
    };
    if (bytes > most) refuse_size();
    std::string content;
    content.resize(static_cast<std::size_t>(bytes) + 1);
    std::size_t held = 0;
    for (;;) {
        if (held == content.size()) content.resize(2 * content.size() + 4096);
        const std::size_t got = std::fread(content.data() + held, 1, content.size() - held, file.get());
        if (got == 0) break;
        held += got;
        if (held > most) refuse_size();
    }
    if (std::ferror(file.get()) != 0) {
        throw InputError(fmt::format("{} cannot be read: {}.", path.string(), std::strerror(errno)));
    }
    content.resize(held);
    return content;
}

}  // namespace delassus
