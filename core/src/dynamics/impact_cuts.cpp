// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/impact_cuts.hpp"

#include <algorithm>
#include <functional>
#include <numeric>
#include <utility>

#include "dynamics/substeps.hpp"

namespace delassus {

void ImpactCuts::step(Timestepper& stepper, State& state, double h, StepSolver& solver, StepReport& report) {
    const State begin = state;
    std::vector<double> memory = stepper.save();
    stepper.step(state, h, solver, report);
    if (report.cut > 0.0)
        try_cuts(stepper, begin, std::move(memory), h, most_substeps, &StepReport::cut, state, solver, report);
}

bool ImpactCuts::cut(Timestepper& stepper, const State& begin, std::vector<double> memory, double h, std::int64_t most,
                     State& state, StepSolver& solver, StepReport& report) {
    return try_cuts(stepper, begin, std::move(memory), h, std::min(most, most_substeps), &StepReport::second_impact_cut,
                    state, solver, report);
}

bool ImpactCuts::try_cuts(Timestepper& stepper, const State& begin, std::vector<double> memory, double h,
                          std::int64_t most, Cut cut, State& state, StepSolver& solver, StepReport& report) {
    constexpr double rounding = 1e-6;
    State whole = std::move(state);
    StepReport of_whole = std::move(report);
    const std::vector<double> after = stepper.save();
    state = begin;
    bool kept = false;
    try {
        step_in_cuts(stepper, state, h, of_whole.*cut, std::move(memory), most, cut, solver, report);
        const double faint = rounding * kinetic(begin);
        kept = gain(begin, state) <= faint || gain(whole, state) <= faint;
    } catch (const StepFailure&) {
        // The whole step could be taken.
    }
    stepper.follow_impacts(false);
    if (kept) {
        report.cut = report.second_impact_cut = 0.0;
        return true;
    }
    state = std::move(whole);
    report = std::move(of_whole);
    stepper.load(after);
    return false;
}

void ImpactCuts::step_in_cuts(Timestepper& stepper, State& state, double h, double first, std::vector<double> memory,
                              std::int64_t most, Cut cut, StepSolver& solver, StepReport& report) {
    const double end = state.t + h;
    double part = first;
    StepReport before;
    stepper.follow_impacts(true);
    for (std::int64_t cuts = 1; part > shortest_substep * h;) {
        const State begin = state;
        stepper.load(memory);
        stepper.step(state, part, solver, report);
        if (report.*cut > 0.0 && cuts < most) {
            ++cuts;
            part = report.*cut;
            state = begin;
            continue;
        }
        memory = stepper.save();
        if (!before.error.empty()) report.error.resize(before.error.size(), 0.0);
        std::transform(before.error.begin(), before.error.end(), report.error.begin(), report.error.begin(),
                       std::plus<>());
        report.follow(before);
        before = report;
        part = end - state.t;
    }
    state.t = end;
}

double ImpactCuts::kinetic(const State& state) {
    return kinetic_energy(system_, state, state.v, momentum_);
}

// The work of forces is that of the trapezoidal rule: exact for weight and loads, for springs up to the third power of
// the way.
double ImpactCuts::gain(const State& from, const State& to) {
    way_.resize(to.v.size());
    forces_.assign(to.v.size(), 0.0);
    system_.difference(from.q.data(), to.q.data(), way_.data());
    for (const State* at : {&from, &to}) system_.add_force(*at, 0.5, forces_.data());
    return kinetic(to) - kinetic(from) - std::inner_product(way_.begin(), way_.end(), forces_.begin(), 0.0);
}

}  // namespace delassus
