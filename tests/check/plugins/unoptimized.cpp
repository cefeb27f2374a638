// SPDX-License-Identifier: BSD-3-Clause
#include "sweeps.hpp"

FIXTURE_PLUGIN("unoptimized", "says that its compiler did not optimise", descriptor.build = DELASSUS_BUILD_UNOPTIMIZED)
