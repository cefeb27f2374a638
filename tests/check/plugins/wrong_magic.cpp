// SPDX-License-Identifier: BSD-3-Clause
#include "sweeps.hpp"

FIXTURE_PLUGIN("wrong_magic", "its descriptor begins with other bytes", descriptor.magic = 0x12345678u)
