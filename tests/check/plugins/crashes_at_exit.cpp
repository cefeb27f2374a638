// SPDX-License-Identifier: BSD-3-Clause
#include <csignal>

#include "sweeps.hpp"

namespace {
struct CrashesAtExit {
    ~CrashesAtExit() { std::raise(SIGABRT); }
};
const CrashesAtExit crash;
}  // namespace

FIXTURE_PLUGIN("crashes_at_exit", "its global destructor crashes", static_cast<void>(descriptor))
