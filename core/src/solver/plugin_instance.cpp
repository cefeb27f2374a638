// SPDX-License-Identifier: BSD-3-Clause
#include "solver/plugin_instance.hpp"

#include <vector>

#include "delassus/error.hpp"
#include "support/crash_signals.hpp"

namespace delassus {

Status status_of(std::int32_t raw) {
    switch (raw) {
        case DELASSUS_SOLVED:
            return Status::Solved;
        case DELASSUS_ITERATION_LIMIT:
            return Status::IterationLimit;
        case DELASSUS_TIME_LIMIT:
            return Status::TimeLimit;
        case DELASSUS_STALLED:
            return Status::Stalled;
        case DELASSUS_INFEASIBLE:
            return Status::Infeasible;
        case DELASSUS_NUMERICAL_FAILURE:
            return Status::NumericalFailure;
        case DELASSUS_CANCELLED:
            return Status::Cancelled;
        default:
            return Status::Error;
    }
}

PluginInstance::PluginInstance(std::shared_ptr<const Plugin> plugin, const OptionTexts& chosen)
    : plugin_(std::move(plugin)), who_("the solver " + info().name) {
    const auto resolved = resolve_options(info().name, info().options, chosen);
    std::vector<delassus_option_value> values;
    for (const auto& value : resolved) {
        const bool textual = value.type == DELASSUS_OPTION_CHOICE || value.type == DELASSUS_OPTION_TEXT;
        values.push_back(
            {value.key.c_str(), value.type, 0, value.integer, value.real, textual ? value.text.c_str() : nullptr});
    }
    const CrashSignals kept;
    const auto status = guarded(
        "create", [&] { return border().create(values.data(), static_cast<std::int32_t>(values.size()), &solver_); });
    if (status != DELASSUS_SOLVED || !solver_) {
        solver_ = nullptr;
        throw InputError(fmt::format("{} cannot be set up: {}", info().name, last_error()));
    }
}

PluginInstance::~PluginInstance() {
    if (solver_) guarded("destroy", [&] { return border().destroy(solver_), DELASSUS_SOLVED; });
}

std::string PluginInstance::last_error() const {
    if (!thrown_.empty()) return thrown_;
    const ForeignCall call(who_, "in last_error", ForeignCall::patience);
    const char* text = border().last_error(solver_);
    return text && *text ? text : "it gave no reason";
}

}  // namespace delassus
