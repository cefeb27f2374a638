// SPDX-License-Identifier: BSD-3-Clause
#include "support/output_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>

#include "delassus/error.hpp"
#include "support/atomic_file.hpp"
#include "support/checksum.hpp"
#include "support/text_file.hpp"

namespace delassus {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view checksum_key = ", crc32 ";

bool is_there(const fs::path& path) {
    std::error_code error;
    return fs::exists(fs::symlink_status(path, error));
}

/// A folder, and not a link to one.
bool is_real_folder(const fs::path& path) {
    std::error_code error;
    return fs::is_directory(fs::symlink_status(path, error));
}

struct Mark {
    std::string kind;
    std::vector<std::string> names;
};

/// Names lead to nowhere outside of the folder.
bool stays_within(const fs::path& name) {
    return !name.empty() && name.is_relative() && name != folder_mark &&
           std::none_of(name.begin(), name.end(), [](const fs::path& part) { return part == ".." || part == "."; });
}

/// The mark of the folder; nothing if there is none, or one whose writer was ended before it had a line.
std::optional<Mark> read_mark(const fs::path& folder) {
    const fs::path file = folder / folder_mark;
    if (!is_there(file)) return std::nullopt;
    std::istringstream lines(read_file(file));
    Mark mark;
    std::string line;
    if (!std::getline(lines, line)) return std::nullopt;
    constexpr std::string_view opening = "delassus ";
    if (!line.starts_with(opening)) throw InputError(fmt::format("{} is damaged.", file.string()));
    mark.kind = line.substr(opening.size());
    while (std::getline(lines, line)) {
        if (!stays_within(line))
            throw InputError(fmt::format("{} is damaged: \"{}\" is no name.", file.string(), line));
        mark.names.push_back(line);
    }
    return mark;
}

std::string head_of(std::string_view kind) {
    return fmt::format("delassus {}\n", kind);
}

/// What is in the folder beside its mark.
std::vector<std::string> entries_of(const fs::path& folder) {
    std::vector<std::string> names;
    std::error_code error;
    for (auto entry = fs::directory_iterator(folder, error); !error && entry != fs::directory_iterator();
         entry.increment(error))
        if (entry->path().filename() != folder_mark) names.push_back(entry->path().filename().string());
    if (error) throw InputError(fmt::format("{} cannot be listed: {}.", folder.string(), error.message()));
    std::sort(names.begin(), names.end());
    return names;
}

[[noreturn]] void refuse_foreign(const fs::path& folder, const std::string& entry) {
    throw InputError(
        fmt::format("{} holds {}, which delassus did not write; choose another folder.", folder.string(), entry));
}

void require_kind(const fs::path& folder, const Mark& mark, std::string_view kind) {
    if (mark.kind != kind)
        throw InputError(
            fmt::format("{} was written by delassus as \"{}\", which a \"{}\" does not replace; choose another folder.",
                        folder.string(), mark.kind, kind));
}

bool is_own_file(const fs::path& file) {
    constexpr std::size_t searched = 16384;
    std::error_code error;
    if (!fs::is_regular_file(file, error)) return false;
    std::ifstream stream(file, std::ios::binary);
    std::string begin(searched, '\0');
    stream.read(begin.data(), searched);
    begin.resize(static_cast<std::size_t>(stream.gcount()));
    const auto at = begin.find(file_mark);
    if (at == std::string::npos) return false;
    const std::string_view rest = std::string_view(begin).substr(at + file_mark.size());
    if (!rest.starts_with(checksum_key))  // what people do not edit
        return begin.starts_with("\x89HDF") ||
               begin.starts_with(fmt::format("<!doctype html>\n<!-- {} -->", file_mark));
    const std::string text = read_file(file);
    const auto end = text.find('\n', at);
    if (end == std::string::npos) return false;
    return rest.substr(checksum_key.size())
        .starts_with(fmt::format("{:08x}\n", checksum(std::string_view(text).substr(end + 1))));
}

/// A listed name without the slash that tells folders.
fs::path path_of(const std::string& name) {
    return name.ends_with('/') ? name.substr(0, name.size() - 1) : name;
}

/// Whether the folder of the name is in the outer one, and not behind a link to somewhere else.
bool is_within(const fs::path& folder, const fs::path& name) {
    fs::path place = folder;
    return std::all_of(name.begin(), name.end(), [&](const fs::path& part) { return is_real_folder(place /= part); });
}

/// What killed processes have left of these names.
void remove_leftovers_of(const fs::path& folder, const std::vector<std::string>& names) {
    std::map<fs::path, std::set<std::string>> by_folder;
    for (const auto& name : names) {
        const fs::path path = path_of(name);
        by_folder[path.parent_path()].insert(path.filename().string());
    }
    for (const auto& [inner, targets] : by_folder)
        if (is_within(folder, inner))
            remove_leftovers(folder / inner,
                             [&targets = targets](const std::string& name) { return targets.contains(name); });
}

/// Removes what the mark of the folder lists. A folder in it that holds more stays.
void remove_listed(const fs::path& folder, const std::vector<std::string>& names) {
    const auto remove_file = [](const fs::path& file) {
        if (unlink(file.c_str()) != 0 && errno != ENOENT && errno != EISDIR)
            throw InputError(fmt::format("{} cannot be removed: {}.", file.string(), std::strerror(errno)));
    };
    remove_leftovers_of(folder, names);
    for (auto name = names.rbegin(); name != names.rend(); ++name) {
        const fs::path inner = path_of(*name), place = folder / inner;
        if (!is_within(folder, inner.parent_path())) continue;
        if (!is_real_folder(place)) {
            remove_file(place);
            continue;
        }
        if (const auto mark = read_mark(place)) {
            remove_listed(place, mark->names);
            remove_file(place / folder_mark);
        }
        rmdir(place.c_str());
    }
}

/// Locks the file, or says that another process has. One that is killed takes its children with it, but not at once.
bool is_locked_elsewhere(int file) {
    constexpr timespec pause{0, 20'000'000};
    for (int attempts = 100; attempts > 0; --attempts) {
        if (flock(file, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return false;
        nanosleep(&pause, nullptr);
    }
    return true;
}

/// The process that has locked the file, 0 if the system does not tell.
pid_t holder_of(int file) {
    struct stat status {};
    if (fstat(file, &status) != 0) return 0;
    const std::string node =
        fmt::format(" {:02x}:{:02x}:{} ", major(status.st_dev), minor(status.st_dev), status.st_ino);
    std::ifstream locks("/proc/locks");
    for (std::string line; std::getline(locks, line);) {
        if (line.find(node) == std::string::npos || line.find("->") != std::string::npos) continue;
        std::istringstream words(line);
        std::string number, kind, how, access;
        pid_t holder = 0;
        words >> number >> kind >> how >> access >> holder;
        return std::max(0, holder);
    }
    return 0;
}

}  // namespace

std::string marked_text(std::string_view comment, const std::string& text) {
    return fmt::format("{} {}{}{:08x}\n{}", comment, file_mark, checksum_key, checksum(text), text);
}

void require_replaceable(const fs::path& path, std::string_view kind) {
    remove_leftovers(path);
    if (!is_there(path)) return;
    std::error_code error;
    if (!fs::is_directory(path, error)) {
        if (is_own_file(path)) return;
        throw InputError(fmt::format(
            "{} exists, and delassus did not write it as it is; remove it or give another name.", path.string()));
    }
    const auto entries = entries_of(path);
    const auto mark = read_mark(path);
    if (mark) require_kind(path, *mark, kind);
    const auto is_listed = [&](const std::string& name) {
        return mark && std::find(mark->names.begin(), mark->names.end(), name) != mark->names.end();
    };
    for (const auto& entry : entries) {
        if (!is_real_folder(path / entry)) {
            if (!is_listed(entry)) refuse_foreign(path, entry);
        } else {
            if (!is_listed(entry + "/")) refuse_foreign(path, entry);
            require_replaceable(path / entry, kind);
        }
    }
}

void write_folder_mark(const fs::path& folder, std::string_view kind, const std::vector<std::string>& names) {
    write_file_atomically(folder / folder_mark, fmt::format("{}{}\n", head_of(kind), fmt::join(names, "\n")));
}

void add_to_folder_mark(const fs::path& folder, const std::string& name) {
    const auto mark = read_mark(folder);
    if (mark && std::find(mark->names.begin(), mark->names.end(), name) == mark->names.end())
        append_to_file(folder / folder_mark, name + '\n');
}

OutputFolder::OutputFolder(fs::path folder, std::string kind, const std::vector<std::string>& adopted)
    : folder_(std::move(folder)), kind_(std::move(kind)) {
    std::error_code error;
    if (is_there(folder_) && !fs::is_directory(folder_, error))
        throw InputError(fmt::format("{} is a file; the output needs a folder.", folder_.string()));
    made_ = fs::create_directories(folder_, error);
    if (error) throw InputError(fmt::format("{} cannot be made: {}.", folder_.string(), error.message()));
    try {
        lock(adopted);
    } catch (...) {
        if (lock_ >= 0) close(lock_);
        if (made_) rmdir(folder_.c_str());
        throw;
    }
}

void OutputFolder::lock(const std::vector<std::string>& adopted) {
    const fs::path file = folder_ / folder_mark;
    const auto require_adopted = [&] {
        for (const auto& entry : entries_of(folder_))
            if (std::find(adopted.begin(), adopted.end(), entry) == adopted.end()) refuse_foreign(folder_, entry);
    };
    if (!is_there(file)) require_adopted();
    const auto still_there = [&] {
        struct stat opened {
        }, named{};
        return fstat(lock_, &opened) == 0 && stat(file.c_str(), &named) == 0 && opened.st_ino == named.st_ino;
    };
    do {  // one that gives up its new folder takes the mark away
        if (lock_ >= 0) close(lock_);
        lock_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
        if (lock_ < 0)
            throw InputError(fmt::format("{} cannot be written: {}.", folder_.string(), std::strerror(errno)));
        // A file system without locks gives none; then nobody is refused.
        if (is_locked_elsewhere(lock_)) {
            const pid_t holder = holder_of(lock_);
            throw InputError(fmt::format("{} is being written by {}; wait for its end, or choose another folder.",
                                         folder_.string(),
                                         holder > 0 ? fmt::format("process {}", holder) : "another process"));
        }
    } while (!still_there());
    if (const auto mark = read_mark(folder_)) {
        require_kind(folder_, *mark, kind_);
        names_.insert(mark->names.begin(), mark->names.end());
        remove_leftovers_of(folder_, mark->names);
        return;
    }
    std::string text = head_of(kind_);
    for (const auto& entry : entries_of(folder_)) {
        const std::string name = entry + (is_real_folder(folder_ / entry) ? "/" : "");
        names_.insert(name);
        text += name + '\n';
    }
    kept_ = !names_.empty();
    try {
        require_adopted();
        append_to_file(file, text);
    } catch (const InputError&) {
        unlink(file.c_str());
        throw;
    }
}

OutputFolder::~OutputFolder() {
    if (!kept_) {
        try {
            remove_listed(folder_, {names_.begin(), names_.end()});
            unlink((folder_ / folder_mark).c_str());
            if (made_) rmdir(folder_.c_str());
        } catch (const std::exception&) {  // what cannot be removed stays listed
        }
    }
    if (lock_ >= 0) close(lock_);
}

void OutputFolder::clear() {
    remove_listed(folder_, {names_.begin(), names_.end()});
    names_.clear();
    kept_ = false;
    if (ftruncate(lock_, static_cast<off_t>(head_of(kind_).size())) != 0)
        throw InputError(
            fmt::format("{} cannot be written: {}.", (folder_ / folder_mark).string(), std::strerror(errno)));
}

void OutputFolder::list(const std::string& line) {
    if (!stays_within(path_of(line)) || line.find('\n') != std::string::npos)
        throw InputError(fmt::format("{}: \"{}\" is no name for a file.", folder_.string(), line));
    append_to_file(folder_ / folder_mark, line + '\n');
    names_.insert(line);
}

fs::path OutputFolder::add(const std::string& name) {
    fs::path place = folder_ / name;
    if (names_.contains(name) || names_.contains(name + '/')) return place;
    if (is_there(place)) refuse_foreign(folder_, name);
    list(name);
    return place;
}

fs::path OutputFolder::add_folder(const std::string& name) {
    fs::path place = folder_ / name;
    const bool listed = names_.contains(name + '/');
    if (is_real_folder(place)) return place;
    if (is_there(place)) refuse_foreign(folder_, name);
    if (!listed) list(name + '/');
    std::error_code error;
    fs::create_directory(place, error);
    if (error) throw InputError(fmt::format("{} cannot be made: {}.", place.string(), error.message()));
    return place;
}

void OutputFolder::write(const std::string& name, std::string_view content) {
    write_file_atomically(add(name), content);
}

void OutputFolder::remove(const std::string& name) {
    if (names_.contains(name)) unlink((folder_ / name).c_str());
}

}  // namespace delassus
