// SPDX-License-Identifier: BSD-3-Clause
#include "support/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <deque>
#include <fstream>

#include "delassus/error.hpp"
#include "support/checksum.hpp"
#include "support/output_folder.hpp"

namespace delassus {
namespace fs = std::filesystem;
namespace {

/// "out/", "out/." and "out" are the same target, and a temporary name goes beside it, not into it.
fs::path without_trailing_slash(const fs::path& path) {
    fs::path clean = path.lexically_normal();
    if (!clean.has_filename() && clean.has_relative_path()) clean = clean.parent_path();
    if (clean == "." || clean == ".." || !clean.has_filename()) {
        std::error_code error;
        const fs::path canonical = fs::weakly_canonical(fs::absolute(path, error), error);
        if (!error) clean = canonical;
    }
    return clean;
}

void require_parent(const fs::path& target) {
    const fs::path parent = target.has_parent_path() ? target.parent_path() : fs::path(".");
    std::error_code error;
    if (!fs::is_directory(parent, error)) {
        throw InputError(fmt::format("{} cannot be written: there is no folder {}.", target.string(), parent.string()));
    }
}

[[noreturn]] void refuse_write(const fs::path& target, int error_number) {
    throw InputError(fmt::format("{} cannot be written: {}.", target.string(), std::strerror(error_number)));
}

/// 0, or why not all could be written.
int write_all(int file, std::string_view content) {
    while (!content.empty()) {
        const ssize_t written = ::write(file, content.data(), content.size());
        if (written < 0 && errno != EINTR) return errno;
        if (written > 0) content.remove_prefix(static_cast<std::size_t>(written));
    }
    return 0;
}

/// How temporary names of this machine go on after the target's. Machines may share a file system.
std::string partial_ending() {
    std::array<char, 256> host{};
    gethostname(host.data(), host.size() - 1);
    return fmt::format(".partial-{:08x}-", checksum(host.data()));
}

/// A name beside target that nothing has yet.
fs::path temporary_name_beside(const fs::path& target) {
    static std::atomic<unsigned> count{0};
    for (;;) {
        fs::path name = target;
        name += fmt::format("{}{}-{}", partial_ending(), getpid(), count++);
        std::error_code error;
        if (!fs::exists(fs::symlink_status(name, error))) return name;
    }
}

/// Whether there is no such process, or only its exit code, which nobody has asked for yet.
bool has_ended(pid_t process) {
    if (kill(process, 0) != 0) return errno == ESRCH;
    std::ifstream file(fmt::format("/proc/{}/stat", process));
    std::string text;
    std::getline(file, text);  // number, (name), state …
    const auto name_end = text.rfind(')');
    return name_end != std::string::npos && name_end + 2 < text.size() &&
           (text[name_end + 2] == 'Z' || text[name_end + 2] == 'X');
}

}  // namespace

void remove_leftovers(const fs::path& folder, const std::function<bool(const std::string&)>& is_target) {
    const std::string ending = partial_ending();
    std::error_code error;
    std::vector<fs::path> found;
    for (auto entry = fs::directory_iterator(folder.empty() ? "." : folder, error);
         !error && entry != fs::directory_iterator(); entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        const auto at = name.rfind(ending);
        if (at == std::string::npos || !is_target(name.substr(0, at))) continue;
        pid_t writer = 0;
        const char* end = name.data() + name.size();
        const auto [rest, failure] = std::from_chars(name.data() + at + ending.size(), end, writer);
        const bool named_so = failure == std::errc() && writer > 0 && rest != end && *rest == '-';
        if (named_so && has_ended(writer)) found.push_back(entry->path());
    }
    for (const auto& leftover : found) fs::remove_all(leftover, error);
}

void remove_leftovers(const fs::path& target) {
    const fs::path path = without_trailing_slash(target);
    remove_leftovers(path.parent_path(), [&](const std::string& name) { return name == path.filename(); });
}

AtomicFile::AtomicFile(fs::path target) : target_(std::move(target)) {
    require_parent(target_);
    std::error_code error;
    if (fs::is_directory(target_, error)) {
        throw InputError(fmt::format("{} cannot be written: it is a folder.", target_.string()));
    }
    temporary_ = temporary_name_beside(target_);
}

AtomicFile::~AtomicFile() {
    if (!temporary_.empty()) unlink(temporary_.c_str());
}

void AtomicFile::write(std::string_view content) {
    const int file = open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file < 0) refuse_write(target_, errno);
    int failure = write_all(file, content);
    if (close(file) != 0 && failure == 0) failure = errno;
    if (failure != 0) refuse_write(target_, failure);
}

void AtomicFile::commit() {
    if (std::rename(temporary_.c_str(), target_.c_str()) != 0) refuse_write(target_, errno);
    temporary_.clear();
}

void write_file_atomically(const fs::path& path, std::string_view content) {
    AtomicFile target(path);
    target.write(content);
    target.commit();
}

void write_files_atomically(const std::vector<std::pair<fs::path, std::string>>& contents) {
    std::deque<AtomicFile> files;
    for (const auto& [path, content] : contents) files.emplace_back(path).write(content);
    for (AtomicFile& file : files) file.commit();
}

void append_to_file(const fs::path& path, std::string_view content) {
    const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (file < 0) refuse_write(path, errno);
    const off_t end = lseek(file, 0, SEEK_END);
    int failure = write_all(file, content);
    if (failure != 0 && end >= 0 && ftruncate(file, end) != 0) failure = errno;
    if (close(file) != 0 && failure == 0) failure = errno;
    if (failure != 0) refuse_write(path, failure);
}

namespace {

/// The marks of the folder and of those in it, of all that is there.
void write_marks(const fs::path& folder, const std::string& kind) {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const bool inner = fs::is_directory(entry.symlink_status());
        if (inner) write_marks(entry.path(), kind);
        names.push_back(entry.path().filename().string() + (inner ? "/" : ""));
    }
    std::sort(names.begin(), names.end());
    write_folder_mark(folder, kind, names);
}

}  // namespace

void remove_folder_atomically(const fs::path& folder, const std::string& kind) {
    require_replaceable(folder, kind);
    const fs::path old = temporary_name_beside(folder);
    if (std::rename(folder.c_str(), old.c_str()) != 0)
        throw InputError(fmt::format("{} cannot be removed: {}.", folder.string(), std::strerror(errno)));
    std::error_code ignored;
    fs::remove_all(old, ignored);
}

AtomicFolder::AtomicFolder(const fs::path& target, std::string kind)
    : target_(without_trailing_slash(target)), kind_(std::move(kind)) {
    require_parent(target_);
    require_replaceable(target_, kind_);
    std::error_code error;
    if (fs::is_symlink(target_, error)) {
        const fs::path pointed_to = fs::canonical(target_, error);  // a link stays a link: its folder is replaced
        if (!error) target_ = pointed_to;
    }
    temporary_ = temporary_name_beside(target_);
    if (!fs::create_directory(temporary_, error)) {
        throw InputError(fmt::format("{} cannot be written: {}.", target_.string(), error.message()));
    }
}

AtomicFolder::~AtomicFolder() {
    std::error_code ignored;
    if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
}

void AtomicFolder::commit() {
    write_marks(temporary_, kind_);
    std::error_code ignored;
    if (!fs::exists(target_, ignored)) {
        if (std::rename(temporary_.c_str(), target_.c_str()) == 0) {
            temporary_.clear();
            return;
        }
        if (errno != ENOTEMPTY && errno != EEXIST) refuse_write(target_, errno);  // else another process was faster
    }
    // What has come there meanwhile counts too.
    require_replaceable(target_, kind_);
    // One exchange where the file system can do it; the destructor then removes the old folder. Elsewhere two renames,
    // of which the second is undone if it fails.
    if (renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) == 0) return;
    if (errno != EINVAL && errno != ENOSYS) refuse_write(target_, errno);
    const fs::path old = temporary_name_beside(target_);
    if (std::rename(target_.c_str(), old.c_str()) != 0) refuse_write(target_, errno);
    if (std::rename(temporary_.c_str(), target_.c_str()) != 0) {
        const int failure = errno;
        std::rename(old.c_str(), target_.c_str());
        refuse_write(target_, failure);
    }
    temporary_ = old;
}

}  // namespace delassus
