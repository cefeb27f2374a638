// SPDX-License-Identifier: BSD-3-Clause
#include "bench/formula.hpp"

#include <fmt/format.h>

#include <cmath>

#include "bench/key.hpp"
#include "delassus/error.hpp"
#include "support/module.hpp"

namespace delassus::bench {

namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
    throw InputError(
        fmt::format("the formula in \"{}\" {}; a formula has numbers, \"value\", + - * / ^, parentheses and functions "
                    "such as sqrt and exp",
                    text, why));
}

/// The place of the parenthesis that closes the one opened before `begin`.
std::size_t closing(const std::string& text, std::size_t begin) {
    int open = 1;
    for (std::size_t i = begin; i < text.size(); ++i) {
        if (text[i] == '(') ++open;
        if (text[i] == ')' && --open == 0) return i;
    }
    refuse(text, "has no end");
}

double value_of(const std::string& text, const std::string& formula, double value) {
    const auto evaluate = reinterpret_cast<DelassusFormulaValue>(
        module_symbol("delassus_formula", "delassus_formula_value", fmt::format("the formula in \"{}\"", text),
                      "muParser", "; write numbers instead"));
    std::string refusal;
    const double result = evaluate(formula, value, refusal);
    if (!refusal.empty()) refuse(text, fmt::format("cannot be read: {}", refusal));
    if (!std::isfinite(result)) refuse(text, "is not finite");
    return result;
}

}  // namespace

std::string fill_in(const std::string& text, double value) {
    std::string result;
    std::size_t begin = 0;
    for (std::size_t mark; (mark = text.find("$(", begin)) != std::string::npos;) {
        const std::size_t end = closing(text, mark + 2);
        result += text.substr(begin, mark - begin);
        result += digits(value_of(text, text.substr(mark + 2, end - mark - 2), value));
        begin = end + 1;
    }
    return result + text.substr(begin);
}

}  // namespace delassus::bench
