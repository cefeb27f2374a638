// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "delassus/problem.hpp"

namespace delassus {

/// to = from, cheap for steps with many contacts: vectors are not touched where neither cone has bounds.
inline void copy_cone(const Cone& from, Cone& to) {
    to.kind = from.kind;
    to.rows = from.rows;
    to.parameters = from.parameters;
    if (!from.lo.empty() || !to.lo.empty()) to.lo = from.lo;
    if (!from.hi.empty() || !to.hi.empty()) to.hi = from.hi;
}

}  // namespace delassus
