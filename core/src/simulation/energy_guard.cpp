// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/energy_guard.hpp"

#include <algorithm>
#include <cmath>

#include "delassus/simulation.hpp"
#include "dynamics/substeps.hpp"

namespace delassus {
namespace {

bool any_damping(const MultibodySystem& mechanics, const State& state) {
    MatrixAssembler assembler;
    assembler.begin(mechanics.n(), mechanics.n());
    mechanics.add_damping(state, 1.0, Tangent::Symmetric, assembler);
    const auto& entries = assembler.finish().value;
    return std::any_of(entries.begin(), entries.end(), [](double entry) { return entry != 0.0; });
}

}  // namespace

EnergyGuard::EnergyGuard(const SceneSystem& system) {
    const MultibodySystem& mechanics = *system.system;
    const State start = mechanics.initial_state();
    has_contacts_ = mechanics.has_unilateral();
    has_damping_ = any_damping(mechanics, start);
    const auto n = static_cast<std::size_t>(mechanics.n());
    std::vector<double> fall(n, 0.0), momentum(n, 0.0);
    const auto set = [&](std::int32_t column) {
        if (column >= 0) std::copy_n(mechanics.gravity().begin(), 3, fall.begin() + column);
    };
    for (BodyIndex body = 0; body < mechanics.body_count(); ++body) set(mechanics.body_column(body));
    for (std::int32_t node = 0; node < mechanics.node_count(); ++node) set(mechanics.node_column(node));
    for (const auto& body : mechanics.reduced_bodies()) set(body.column);
    mechanics.multiply_mass(start, 1.0, fall.data(), momentum.data());
    fall_ = 0.0;
    for (std::size_t i = 0; i < n; ++i) fall_ += 2.0 * fall[i] * momentum[i];
    // Digits of the positions: all entries move by 1e-10 of the largest coordinate.
    double largest = 0.0;
    for (const double value : start.q) largest = std::max(largest, std::abs(value));
    std::fill(fall.begin(), fall.end(), 1e-10 * largest);
    std::fill(momentum.begin(), momentum.end(), 0.0);
    mechanics.multiply_mass(start, 1.0, fall.data(), momentum.data());
    digits_ = 0.0;
    for (std::size_t i = 0; i < n; ++i) digits_ += std::abs(fall[i] * momentum[i]);
}

bool EnergyGuard::watches(const SimulationTotals& totals) {
    return std::isfinite(totals.start_energy) && std::isfinite(totals.supplied);
}

const char* EnergyGuard::though(const SimulationTotals& totals) {
    return totals.turnover > 0.0 ? "beyond what loads, motors and given motions supply" : "though nothing supplies any";
}

double EnergyGuard::scale(const SimulationTotals& totals, double longest_step) const {
    const double from_outside =
        std::isnan(totals.supplied) ? std::abs(totals.energy - totals.start_energy) : totals.turnover;
    const double available = totals.start_kinetic + totals.potential_drop + totals.recovered + from_outside;
    const double square = longest_step * longest_step;
    const double floor = fall_ * square + digits_ / square + 1e-10 * std::abs(totals.start_energy);
    return std::max(available, floor);
}

double EnergyGuard::loss(const SimulationTotals& totals) const {
    if (has_damping_) return 0.0;
    if (std::isfinite(totals.rest)) return std::max(-totals.rest - totals.doubt - totals.damped, 0.0);
    if (has_contacts_ || !watches(totals)) return 0.0;
    return std::max(totals.start_energy + totals.supplied - totals.energy, 0.0);
}

double EnergyGuard::growth(const SimulationTotals& totals, double energy, double recovered, bool again) {
    return std::max(energy - totals.start_energy - totals.credit,
                    energy - totals.recovered - recovered - (again ? totals.lowest_before : totals.lowest));
}

void EnergyWatch::begin(const SimulationTotals& totals, double t, double h) {
    const double budget = accuracy_ * guard_.scale(totals, std::max(totals.largest_step, h));
    h_ = h;
    totals_ = &totals;
    before_ = totals.growth;
    last_taken_ = HUGE_VAL;
    const double left = system_.planned_end > t ? system_.planned_end - t : system_.planned_end;
    allowed_ = before_ < budget && totals.start_overlap == 0.0 && !system_.system->is_driven() && guard_.watches(totals)
                   ? std::max(0.5 * budget, before_ + (budget - before_) * std::min(h / left, 1.0))
                   : HUGE_VAL;
}

void EnergyWatch::require_within(double energy, double h) {
    constexpr double helps = 0.7;
    const double growth = EnergyGuard::growth(*totals_, energy, recovered_, again_);
    const bool shortest = h < 1.5 * h_ / static_cast<double>(most_substeps);
    if (growth <= allowed_ || growth - before_ > helps * last_taken_ || shortest) return;
    last_taken_ = growth - before_;
    throw Gain("the energy grows by more than the accuracy allows, though nothing supplies any");
}

}  // namespace delassus
