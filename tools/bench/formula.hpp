// SPDX-License-Identifier: BSD-3-Clause
// Formulas in a suite's axes: "[0, 0, $(0.5 * value)]", by the module delassus_formula, which the first formula loads.
// So muParser is mapped only into processes that read formulas.
#pragma once

#include <string>

namespace delassus::bench {

/// The text with each $(…) replaced by the digits of what stands in it: a formula of `value` in muParser's syntax, with
/// its functions and constants. Throws InputError saying what cannot be read, where the result is not finite, and where
/// this build has no muParser; a text without $( comes back as it is.
[[nodiscard]] std::string fill_in(const std::string& text, double value);

}  // namespace delassus::bench

// The module is built together with the bench, so C++ types may cross here.
extern "C" {
/// delassus_formula_value of delassus_formula.so: the formula at this value, or why it cannot be read in `refusal`.
using DelassusFormulaValue = double (*)(const std::string& formula, double value, std::string& refusal);
}
