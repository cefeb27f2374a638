// SPDX-License-Identifier: BSD-3-Clause
// Another minor version with a descriptor of the same size is welcome.
#include "sweeps.hpp"

FIXTURE_PLUGIN("other_minor", "built for another minor version", descriptor.abi_minor = DELASSUS_ABI_MINOR + 7)
