// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <stdexcept>

#include "sweeps.hpp"

namespace {
std::int32_t create(const delassus_option_value*, std::int32_t, void**) {
    throw std::runtime_error("thrown in create");
}
}  // namespace

FIXTURE_PLUGIN("throws_in_create", "throws through the border", descriptor.create = create)
