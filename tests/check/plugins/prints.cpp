// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <cstdio>

#include "sweeps.hpp"

namespace {
std::int32_t factorize(void* solver, const delassus_problem* problem) {
    std::puts("a banner of the library");
    return fixture::original().factorize(solver, problem);
}
}  // namespace

FIXTURE_PLUGIN("prints", "prints to standard output", descriptor.factorize = factorize)
