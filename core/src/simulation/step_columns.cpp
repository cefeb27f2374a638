// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/step_columns.hpp"

#include <algorithm>

namespace delassus {
namespace {

template <class Number>
void add(Summary summary, Number value, Number& total) {
    switch (summary) {
        case Summary::Last:
            total = value;
            break;
        case Summary::Sum:
            total += value;
            break;
        case Summary::Largest:
            total = std::max(total, value);
            break;
        case Summary::None:
            break;
    }
}

/// Real numbers have real totals, integers and truth values integer ones.
constexpr bool fit_together(const StepColumn& column) {
    if (std::holds_alternative<double SimulationTotals::*>(column.total))
        return std::holds_alternative<double StepRecord::*>(column.value);
    return std::holds_alternative<std::monostate>(column.total) || column.integer();
}
static_assert(std::all_of(step_columns.begin(), step_columns.end(), fit_together));
// Every total has a row: all but the four texts are of eight bytes.
static_assert(sizeof(SimulationTotals) == (total_columns.size() - 5) * sizeof(double) + 5 * sizeof(std::string));

}  // namespace

void add_step(const StepRecord& record, SimulationTotals& totals) {
    for (const StepColumn& column : step_columns) {
        if (const auto* real = std::get_if<double SimulationTotals::*>(&column.total)) {
            add(column.summary, record.*std::get<double StepRecord::*>(column.value), totals.**real);
        } else if (const auto* integer = std::get_if<std::int64_t SimulationTotals::*>(&column.total)) {
            const auto* truth = std::get_if<bool StepRecord::*>(&column.value);
            const std::int64_t value =
                truth ? std::int64_t{record.**truth} : record.*std::get<std::int64_t StepRecord::*>(column.value);
            add(column.summary, value, totals.**integer);
        }
    }
}

}  // namespace delassus
