// SPDX-License-Identifier: BSD-3-Clause
#include "sweeps.hpp"

FIXTURE_PLUGIN("../Bad Name", "its name is no word", static_cast<void>(descriptor))
