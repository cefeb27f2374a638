// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "delassus/problem.hpp"

namespace delassus {

/// What is known to be right of a problem, and need not be looked at.
struct Known {
    bool places = false;  ///< where entries stand, and that the cones' rows are m
    bool H = false;       ///< the values of H
    bool rows = false;    ///< the values of D and b
};

/// As validate(), but for what is known.
void validate(const Problem& problem, const Known& known);

}  // namespace delassus
