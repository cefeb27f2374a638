// SPDX-License-Identifier: BSD-3-Clause
#include "sweeps.hpp"

FIXTURE_PLUGIN("missing_operation", "cannot factorize", descriptor.factorize = nullptr)
