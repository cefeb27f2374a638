// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>
#include <cstdint>

#include "sweeps.hpp"

namespace {
std::int32_t analyze(void*, const delassus_problem*) {
    _exit(7);
}
}  // namespace

FIXTURE_PLUGIN("exits", "ends the process", descriptor.analyze = analyze)
