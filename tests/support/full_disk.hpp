// SPDX-License-Identifier: BSD-3-Clause
// Two ways to run out of disk: a file system that is full, and a limit on the size of files, which needs no rights.
#pragma once

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <string>

namespace delassus::tests {

/// No file of this process and of those that it starts may grow beyond so many bytes while this lives.
class FileSizeLimit {
public:
    explicit FileSizeLimit(rlim_t bytes) {
        old_handler_ = std::signal(SIGXFSZ, SIG_IGN);
        getrlimit(RLIMIT_FSIZE, &old_);
        const rlimit limited{bytes, old_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limited);
    }
    FileSizeLimit(const FileSizeLimit&) = delete;
    FileSizeLimit& operator=(const FileSizeLimit&) = delete;
    ~FileSizeLimit() {
        setrlimit(RLIMIT_FSIZE, &old_);
        std::signal(SIGXFSZ, old_handler_);
    }

private:
    rlimit old_{};
    void (*old_handler_)(int);
};

/// A small file system in memory on a folder, in a mount namespace of this process: nothing of it is seen elsewhere or
/// outlives the process.
class SmallDisk {
public:
    SmallDisk(std::filesystem::path folder, std::size_t bytes) : folder_(std::move(folder)) {
        const std::string options = "size=" + std::to_string(bytes);
        std::filesystem::create_directories(folder_);
        if (!own_namespace() || mount("tmpfs", folder_.c_str(), "tmpfs", 0, options.c_str()) != 0) {
            refusal_ = std::string("no file system can be mounted here: ") + std::strerror(errno);
        }
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;
    ~SmallDisk() {
        if (refusal_.empty()) umount2(folder_.c_str(), MNT_DETACH);
    }

    /// Why there is none; empty if there is one.
    [[nodiscard]] const std::string& refusal() const { return refusal_; }

    /// Fills it up but for so many bytes.
    void fill(off_t left) const {
        const int file = open(ballast().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
        const std::string page(4096, 'x');
        off_t size = 0;
        while (write(file, page.data(), page.size()) == static_cast<ssize_t>(page.size()))
            size += static_cast<off_t>(page.size());
        if (ftruncate(file, std::max<off_t>(0, size - left)) != 0) std::abort();
        close(file);
    }
    /// Takes away what fill() wrote.
    void make_room() const { std::filesystem::remove(ballast()); }

private:
    [[nodiscard]] std::filesystem::path ballast() const { return folder_ / "ballast"; }

    static bool own_namespace() {
        static const bool made =
            unshare(CLONE_NEWNS) == 0 && mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
        return made;
    }

    std::filesystem::path folder_;
    std::string refusal_;
};

}  // namespace delassus::tests
