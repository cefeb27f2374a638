// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>

#include "sweeps.hpp"

namespace {
std::int32_t factorize(void*, const delassus_problem*) {
    throw 42;
}
}  // namespace

FIXTURE_PLUGIN("throws_a_number", "throws something that is no exception", descriptor.factorize = factorize)
