// SPDX-License-Identifier: BSD-3-Clause
// How a simulation comes to the next state that is shown: by one step, by parts of it, or by what lies ahead.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "delassus/error.hpp"
#include "delassus/simulation.hpp"
#include "simulation/energy_guard.hpp"
#include "simulation/fixed_step.hpp"
#include "simulation/look_ahead.hpp"
#include "simulation/overlap_watch.hpp"
#include "simulation/shared_run.hpp"
#include "simulation/sleeping.hpp"
#include "simulation/step_retries.hpp"

namespace delassus {

bool Simulation::advance_fixed(State& state, AdaptiveStepReport& report, const std::vector<double>& memory) {
    const sdk::Team team = solver_->team();
    if (overlaps_) overlaps_->begin(bodies_at(state, next_bodies_), report.h, team);
    const double begin = state.t, end = begin + report.h;
    // Where bodies come to overlap in the whole step, what solves leave of gaps is to shrink with its parts.
    bool deep = false;
    const auto take = [&](State& moved, double h, StepReport& part) {
        if (deep) solver_->solve_to(h / report.h);
        if (energy_ && moved.t == begin) energy_->begin_trial();
        solver_->forget_misses();
        take_step(moved, h, part);
        solver_->require_usable();
        if (energy_) energy_->note_recovered(part.recovered);
        if (overlaps_) overlaps_->require_within(bodies_at(moved, next_bodies_), h, team);
        if (energy_ && moved.t > end - 0.5 * h)
            energy_->require_within(system_->system->energy(bodies_at(moved, next_bodies_)), h);
    };
    const auto take_whole = [&] {
        StepRetries retries(*system_->system, *solver_, !restitutes_);
        while (true) {
            try {
                take(state, report.h, report.step);
                return;
            } catch (const StepTooDeep& failure) {
                retries.prepare(failure, report.step.contacts, bodies_at(state, next_bodies_));
            } catch (const StepTooLong&) {
                retries.give_up();
                throw;
            }
            state = now_.state;
            timestepper_->restart();
            timestepper_->load(memory);
        }
    };
    try {
        take_whole();
    } catch (const StepTooLong& failure) {
        deep = dynamic_cast<const StepTooDeep*>(&failure) != nullptr;
        const struct AsBefore {
            StepSolver& solver;
            ~AsBefore() { solver.solve_to(1.0); }
        } as_before{*solver_};
        try {
            record_.parts =
                step_in_parts(*timestepper_, take, now_.state, memory, report.h, state, report.step, failure);
        } catch (const StepTooDeep& last) {
            overlaps_->give_up(last.bodies());
            if (deep_.empty()) deep_ = last.what();
            return false;
        } catch (const StepFailure&) {
            if (!dynamic_cast<const EnergyWatch::Gain*>(&failure)) throw;
            energy_->give_up();
            return false;
        }
    }
    return true;
}

void Simulation::advance(State& state, AdaptiveStepReport& report, const std::vector<double>& memory) {
    if (system_->control) {
        report = control_->step(state, system_->end, *solver_);
        return;
    }
    const FixedStep step = fixed_step(state.t, system_->end, system_->step);
    report.h = step.h;
    if (sleeping_) sleeping_->begin_step(report.h);
    record_.parts = 1;
    if (ahead_) {
        advance_ahead(state, step.end, report.step);
    } else if (control_) {
        const Parts parts = step_within_error(*control_, state, step.end, *solver_, report.step);
        record_.parts = parts.taken;
        report.rejected = parts.rejected;
        report.error = parts.error;
    } else {
        if (energy_) energy_->begin(now_.totals, state.t, report.h);
        while (!advance_fixed(state, report, memory)) {
            state = now_.state;
            timestepper_->restart();
            timestepper_->load(memory);
        }
        if (overlaps_) overlaps_->end();
    }
    state.t = step.end;
    if (sleeping_) sleeping_->end_step(now_.state, state);
}

// Where a step has leapt over a place at which constraints lose rank, its way cannot be returned to them, and one ends
// at the state shown. If none can, as where that is the place itself, it is shown as the way has it.
void Simulation::show_ahead(State& state, double end, StepReport& report) {
    StepReport shown;
    try {
        solver_->forget_misses();
        ahead_->show(end, state, *solver_, shown);
        solver_->require_usable();
        shown.follow(report);
        std::swap(report, shown);
        return;
    } catch (const StepFailure&) {
        state = now_.state;
    }
    const std::vector<double> memory = timestepper_->save(), control = control_->save();
    try {
        timestepper_->restart();
        control_->set_largest(system_->step);
        record_.parts = step_within_error(*control_, state, end, *solver_, shown).taken;
        std::swap(report, shown);
        state.t = end;
        ahead_->begin(state);
    } catch (const StepFailure&) {
        timestepper_->restart();
        timestepper_->load(memory);
        control_->load(control);
        ahead_->read(end, state);
        std::vector<double> off(static_cast<std::size_t>(dynamics().m()));
        dynamics().constraint(state, off.data());
        const double limit = std::min(timestepper_->error_limit(), system_->accuracy);
        if (std::any_of(off.begin(), off.end(), [limit](double C) { return !(std::abs(C) <= limit); })) throw;
    }
}

void Simulation::advance_ahead(State& state, double end, StepReport& report) {
    report.clear();
    std::int64_t parts = 0;
    while (!ahead_->reaches(end)) {
        AdaptiveStepReport part =
            ahead_->advance(end, bodies_at(ahead_->front(), next_bodies_), *timestepper_, *control_, *solver_);
        if (!ahead_->cut_by_corner()) ++parts;
        part.step.follow(report);
        std::swap(report, part.step);
    }
    record_.parts = std::max<std::int64_t>(parts, 1);
    show_ahead(state, end, report);
    report.multipliers.clear();
}

// A step in which an impact leads to another one is cut between them, as often as it has to be: the second one then has
// the speed with which its bodies meet. Restitution gives back no more than there was: else the step stays whole.
void Simulation::take_step(State& state, double h, StepReport& report) {
    if (shared_) return shared_->step(state, h, *timestepper_, *solver_, report);
    if (!restitutes_) return timestepper_->step(state, h, *solver_, report);
    const State begin = state;
    std::vector<double> memory = timestepper_->save();
    timestepper_->step(state, h, *solver_, report);
    if (report.cut == 0.0) return;
    constexpr double rounding = 1e-6;
    const MultibodySystem& mechanics = *system_->system;
    const auto kinetic = [&](const State& at) { return mechanics.kinetic_energy(bodies_at(at, next_bodies_)); };
    // What contacts give on the way from one state to another. The work of forces is that of the trapezoidal rule:
    // exact for weight and loads, for springs up to the third power of the way.
    const auto gain = [&](const State& from, const State& to) {
        std::vector<double> way(to.v.size()), forces(to.v.size(), 0.0);
        dynamics().difference(from.q.data(), to.q.data(), way.data());
        for (const State* at : {&from, &to}) dynamics().add_force(*at, 0.5, forces.data());
        return kinetic(to) - kinetic(from) - std::inner_product(way.begin(), way.end(), forces.begin(), 0.0);
    };
    State whole = std::move(state);
    StepReport of_whole = std::move(report);
    const std::vector<double> after = timestepper_->save();
    state = begin;
    bool kept = false;
    try {
        step_between_impacts(state, h, of_whole.cut, std::move(memory), report);
        const double most = rounding * kinetic(begin);
        kept = gain(begin, state) <= most || gain(whole, state) <= most;
    } catch (const StepFailure&) {
        // The whole step could be taken.
    }
    timestepper_->follow_impacts(false);
    if (kept) return;
    state = std::move(whole);
    report = std::move(of_whole);
    timestepper_->restart();
    timestepper_->load(after);
}

void Simulation::step_between_impacts(State& state, double h, double first, std::vector<double> memory,
                                      StepReport& report) {
    const double end = state.t + h;
    double part = first;
    StepReport before;
    timestepper_->follow_impacts(true);
    for (std::int64_t cuts = 1; part > shortest_part * h;) {
        const State begin = state;
        timestepper_->restart();
        timestepper_->load(memory);
        timestepper_->step(state, part, *solver_, report);
        if (report.cut > 0.0 && cuts < most_parts) {
            ++cuts;
            part = report.cut;
            state = begin;
            continue;
        }
        memory = timestepper_->save();
        report.follow(before);
        before = report;
        part = end - state.t;
    }
    state.t = end;
}

}  // namespace delassus
