// SPDX-License-Identifier: BSD-3-Clause
// Formulas by muParser; see bench/formula.hpp.
#include <muParser.h>

#include <type_traits>

#include "bench/formula.hpp"
#include "delassus/export.hpp"

extern "C" DELASSUS_API double delassus_formula_value(const std::string& formula, double value, std::string& refusal) {
    try {
        mu::Parser parser;
        parser.DefineConst("value", value);
        parser.SetExpr(formula);
        int results = 0;
        const double* const found = parser.Eval(results);
        if (results == 1) return found[0];
        refusal = "it is a list";
    } catch (const mu::Parser::exception_type& error) {
        refusal = error.GetMsg();
        if (refusal.ends_with('.')) refusal.pop_back();
    }
    return 0.0;
}

static_assert(std::is_same_v<decltype(&delassus_formula_value), DelassusFormulaValue>);
