// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "delassus/error.hpp"
#include "delassus/problem.hpp"

namespace delassus {

/// The parts of a problem that are known to be valid and need no check.
struct Known {
    bool places = false;  ///< where entries stand, and that the cones' rows are m
    bool H = false;       ///< the values of H
    bool rows = false;    ///< the values of D and b
};

/// An entry is infinite or no number.
class DELASSUS_API NotFinite : public InputError {
public:
    using InputError::InputError;
};

/// As validate(), without checking the known parts.
void validate(const Problem& problem, const Known& known);

}  // namespace delassus
