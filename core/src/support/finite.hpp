// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <span>

namespace delassus {

/// Whether all values are finite. v · 0 is NaN for infinite values and NaN only. Eight sums side by side need no branch
/// for each value.
inline bool all_finite(std::span<const double> values) {
    std::array<double, 8> sums{};
    std::size_t k = 0;
    for (; k + sums.size() <= values.size(); k += sums.size())
        for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += values[k + i] * 0.0;
    for (; k < values.size(); ++k) sums[0] += values[k] * 0.0;
    double sum = 0.0;
    for (const double one : sums) sum += one;
    return !std::isnan(sum);
}

}  // namespace delassus
