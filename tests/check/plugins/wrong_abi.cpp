// SPDX-License-Identifier: BSD-3-Clause
#include "sweeps.hpp"

FIXTURE_PLUGIN("wrong_abi", "built for another major version", descriptor.abi_major = 99)
