// SPDX-License-Identifier: BSD-3-Clause
#include "process/stdout_guard.hpp"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>

namespace delassus {

StdoutGuard::StdoutGuard() {
    std::fflush(stdout);
    scratch_ = memfd_create("delassus-stdout", MFD_CLOEXEC);
    if (scratch_ < 0) return;
    saved_ = dup(STDOUT_FILENO);
    if (saved_ >= 0) dup2(scratch_, STDOUT_FILENO);
}

StdoutGuard::~StdoutGuard() {
    release();
}

std::size_t StdoutGuard::release() {
    if (saved_ >= 0) {
        std::fflush(stdout);
        // A plugin may have closed what was saved: then what is printed must fail and not go astray.
        if (dup2(saved_, STDOUT_FILENO) < 0) close(STDOUT_FILENO);
        close(saved_);
        saved_ = -1;
        struct stat information {};
        if (fstat(scratch_, &information) == 0) caught_ = static_cast<std::size_t>(information.st_size);
    }
    if (scratch_ >= 0) {
        close(scratch_);
        scratch_ = -1;
    }
    return caught_;
}

}  // namespace delassus
