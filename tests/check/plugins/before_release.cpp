// SPDX-License-Identifier: BSD-3-Clause
// Built before the first release: magic number and size of the descriptor are today's, but its cones have no stride.
#include "sweeps.hpp"

FIXTURE_PLUGIN("before_release", "built for version 1.0", descriptor.abi_major = 1, descriptor.abi_minor = 0)
