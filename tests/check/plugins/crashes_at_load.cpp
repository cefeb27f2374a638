// SPDX-License-Identifier: BSD-3-Clause
#include <csignal>

#include "sweeps.hpp"

namespace {
[[maybe_unused]] const int crash = std::raise(SIGSEGV);
}  // namespace

FIXTURE_PLUGIN("crashes_at_load", "its global constructor crashes", static_cast<void>(descriptor))
