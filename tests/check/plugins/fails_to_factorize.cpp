// SPDX-License-Identifier: BSD-3-Clause
// Keeps the rules: this is how a failure is reported.
#include <cstdint>

#include "sweeps.hpp"

namespace {
std::int32_t factorize(void*, const delassus_problem*) {
    return DELASSUS_NUMERICAL_FAILURE;
}
const char* last_error(void*) {
    return "the pivot vanished";
}
}  // namespace

FIXTURE_PLUGIN("fails_to_factorize", "cannot factorise anything", descriptor.factorize = factorize;
               descriptor.last_error = last_error)
