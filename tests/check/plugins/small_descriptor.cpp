// SPDX-License-Identifier: BSD-3-Clause
#include "sweeps.hpp"

FIXTURE_PLUGIN("small_descriptor", "its descriptor ends early", descriptor.struct_size = 24)
