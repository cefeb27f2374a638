// SPDX-License-Identifier: BSD-3-Clause
#include "sweeps.hpp"

FIXTURE_PLUGIN("sweeps", "dense block Gauss-Seidel that keeps all the rules", static_cast<void>(descriptor))
