// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/timestepper.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "dynamics/step_memory.hpp"
#include "support/nearest_name.hpp"

namespace delassus {

namespace {

// Filled by the static objects of integrators/ before main(), in an order that is not known; sorted when read.
std::vector<TimestepperInfo>& table() {
    static std::vector<TimestepperInfo> rows;
    return rows;
}

std::vector<std::string> names_where(bool (*condition)(const TimestepperInfo&)) {
    std::vector<std::string> names;
    for (const auto& info : timesteppers())
        if (condition(info)) names.push_back(info.name);
    return names;
}

}  // namespace

Timestepper::~Timestepper() = default;

void StepReport::clear() {
    StepReport empty;
    empty.reactions.swap(reactions);
    empty.contacts.swap(contacts);
    empty.multipliers.swap(multipliers);
    empty.error.swap(error);
    empty.reactions.clear();
    empty.contacts.clear();
    empty.multipliers.clear();
    empty.error.clear();
    *this = std::move(empty);
}

bool StepReport::take(const StepAnswer& answer) {
    natural = std::max(natural, answer.natural);
    if (answer.solved) return true;
    solved = false;
    message = answer.message;
    return false;
}

void StepEnergy::add(const StepEnergy& other, double times) {
    recovered += times * other.recovered;
    damped += times * other.damped;
    supplied += times * other.supplied;
    turnover += times * other.turnover;
    doubt += times * other.doubt;
    work += times * other.work;
}

void StepReport::follow(const StepReport& before) {
    newton_iterations += before.newton_iterations;
    unilateral_blocks = std::max(unilateral_blocks, before.unilateral_blocks);
    linearization = std::max(linearization, before.linearization);
    linearization_rounding = std::max(linearization_rounding, before.linearization_rounding);
    energy.add(before.energy);
    natural = std::max(natural, before.natural);
    if (before.solved) return;
    solved = false;
    message = before.message;
}

StepReport Timestepper::step(State& state, double h, StepSolver& solver) {
    StepReport report;
    step(state, h, solver, report);
    return report;
}

void Timestepper::step(State& state, double h, StepSolver& solver, StepReport& report) {
    report.clear();
    try {
        take_step(state, h, solver, report);
    } catch (const IndefiniteStep& refusal) {
        throw StepTooLong(fmt::format(
            "the step from t = {:.9g} with h = {:.9g} is too long: M + h R + h² K is indefinite, as elements "
            "under strong pressure make it; take shorter steps ({})",
            state.t, h, refusal.what()));
    }
}

StepMemory Timestepper::memory() const {
    throw Unsupported("this method does not say what its memory belongs to");
}
void Timestepper::set_memory(StepMemory&& /*memory*/) {
    throw Unsupported("this method does not say what its memory belongs to");
}

std::vector<double> Timestepper::save() const {
    return multipliers_;
}
void Timestepper::load(const std::vector<double>& memory) {
    multipliers_ = memory;
}

RegisterTimestepper::RegisterTimestepper(TimestepperInfo info) {
    auto& rows = table();
    const auto place = std::lower_bound(rows.begin(), rows.end(), info.name,
                                        [](const auto& row, const std::string& name) { return row.name < name; });
    rows.insert(place, std::move(info));
}

const std::vector<TimestepperInfo>& timesteppers() {
    return table();
}

std::unique_ptr<Timestepper> make_timestepper(std::string_view name, DynamicalSystem& system,
                                              const OptionTexts& options) {
    const auto& rows = timesteppers();
    const auto info = std::find_if(rows.begin(), rows.end(), [&](const auto& row) { return row.name == name; });
    if (info == rows.end()) {
        std::vector<std::string_view> names;
        for (const auto& row : rows) names.push_back(row.name);
        throw InputError(fmt::format("there is no timestepper \"{}\"{}", name, nearest_name_hint(name, names)));
    }
    const auto values = resolve_options(info->name, info->options, options);
    if (system.m() > 0 && !info->constraints)
        throw Unsupported(fmt::format("{} takes no constraints; the system has {} rows of them. Can: {}", info->name,
                                      system.m(),
                                      fmt::join(names_where([](const auto& row) { return row.constraints; }), ", ")));
    if (system.has_unilateral() && !info->unilateral)
        throw Unsupported(fmt::format(
            "{} takes no contacts, stops, dry friction of joints or force limits, which the system has. Can: {}",
            info->name, fmt::join(names_where([](const auto& row) { return row.unilateral; }), ", ")));
    return info->make(system, values);
}

}  // namespace delassus
