// SPDX-License-Identifier: BSD-3-Clause
// One field shorter than the descriptor of version 2.0.
#include <cstddef>

#include "sweeps.hpp"

FIXTURE_PLUGIN("short_descriptor", "lacks the last field of 2.0",
               descriptor.struct_size = offsetof(delassus_plugin_descriptor, last_error))
