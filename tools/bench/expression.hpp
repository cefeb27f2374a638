// SPDX-License-Identifier: BSD-3-Clause
// Formulas in a suite's axes: "[0, 0, $(0.5 * value)]".
#pragma once

#include <string>

namespace delassus::bench {

/// The text with each $(…) replaced by the digits of what stands in it: numbers and `value`, + − * / ^ and parentheses.
/// Throws InputError saying what cannot be read; a text without $( comes back as it is.
[[nodiscard]] std::string fill_in(const std::string& text, double value);

}  // namespace delassus::bench
