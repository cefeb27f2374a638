// SPDX-License-Identifier: BSD-3-Clause
// An order of elimination by nested dissection.
#pragma once

#include <vector>

#include "delassus/sdk/problem_view.hpp"

namespace delassus::ipm {

/// New positions of the rows of a symmetric matrix, of which the lower triangle's pattern is read: rows of a separator
/// come after the two parts that it keeps apart, down to small parts, each ordered by AMD (George and Liu, An automatic
/// nested dissection algorithm for irregular finite element problems, SIAM J. Numer. Anal. 15, 1978). Rows with equal
/// patterns, such as those of one body, stay together.
[[nodiscard]] std::vector<std::int32_t> nested_dissection(const sdk::SparseColumns& lower);

}  // namespace delassus::ipm
