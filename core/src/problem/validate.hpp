// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "delassus/problem.hpp"

namespace delassus {

/// As validate(), for a problem whose entries and rows of cones stand where those of a valid one do: only the numbers
/// are looked at, those of H only if it is new.
void validate_values(const Problem& problem, bool new_H);

}  // namespace delassus
