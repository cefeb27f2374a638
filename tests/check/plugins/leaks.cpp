// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <cstdlib>

#include "sweeps.hpp"

namespace {
// Where the compiler cannot see that nobody wants it.
void* volatile lost;

std::int32_t create(const delassus_option_value* values, std::int32_t count, void** solver) {
    lost = std::malloc(128);
    return fixture::original().create(values, count, solver);
}
}  // namespace

FIXTURE_PLUGIN("leaks", "loses memory with every solver", descriptor.create = create)
