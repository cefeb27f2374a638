// SPDX-License-Identifier: BSD-3-Clause
// Keeps what plugins print away from the program's own standard output.
#pragma once

#include <cstddef>

namespace delassus {

/// While it lives, standard output goes to a scratch file; then it is back where it was. One at a time.
class StdoutGuard {
public:
    StdoutGuard();
    ~StdoutGuard();
    StdoutGuard(const StdoutGuard&) = delete;
    StdoutGuard& operator=(const StdoutGuard&) = delete;

    /// Puts standard output back; how many bytes were caught. Further calls do nothing and answer the same.
    std::size_t release();

private:
    int saved_ = -1;
    int scratch_ = -1;
    std::size_t caught_ = 0;
};

}  // namespace delassus
