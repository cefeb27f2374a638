// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <csignal>
#include <cstddef>

namespace delassus {

/// A library is loaded or makes something while it lives. What a crash does is then as before: UCX, which Open MPI 5
/// brings along, takes these signals as it is loaded.
class CrashSignals {
public:
    CrashSignals() {
        for (std::size_t k = 0; k < numbers.size(); ++k) sigaction(numbers[k], nullptr, &before_[k]);
    }
    ~CrashSignals() {
        for (std::size_t k = 0; k < numbers.size(); ++k) sigaction(numbers[k], &before_[k], nullptr);
    }
    CrashSignals(const CrashSignals&) = delete;
    CrashSignals& operator=(const CrashSignals&) = delete;

private:
    static constexpr std::array numbers = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
    std::array<struct sigaction, numbers.size()> before_;
};

}  // namespace delassus
