// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/watched_step.hpp"

namespace delassus {

WatchedStep::~WatchedStep() {
    if (closes_) solver_.solve_to(1.0);
}

const State& WatchedStep::bodies_at(const State& state) {
    if (!joints_) return state;
    joints_->bodies_of(state, bodies_);
    return bodies_;
}

void WatchedStep::begin(const State& state, double h) {
    if (watched_.energy) watched_.energy->begin(*watched_.totals, state.t, h);
    if (watched_.overlaps) watched_.overlaps->begin(bodies_at(state), h, solver_.team());
}

void WatchedStep::begin_trial(std::int64_t substeps, bool again) {
    if (closes_) solver_.solve_to(1.0 / static_cast<double>(substeps));
    if (watched_.energy) watched_.energy->begin_trial(again);
}

void WatchedStep::judge(const State& state, double h, const StepReport& report, bool last) {
    if (watched_.energy) watched_.energy->note_recovered(report.energy.recovered);
    if (watched_.overlaps) watched_.overlaps->require_within(bodies_at(state), h, solver_.team());
    if (watched_.energy && last) watched_.energy->require_within(system_.energy(bodies_at(state)), h);
}

bool WatchedStep::mend(const StepTooLong& failure, const StepReport& report, const State& state) {
    if (const auto* deep = dynamic_cast<const StepTooDeep*>(&failure)) {
        if (!retries_) retries_.emplace(system_, solver_, expects_);
        retries_->prepare(*deep, report.contacts, bodies_at(state));
        return true;
    }
    if (retries_) retries_->give_up();
    return false;
}

void WatchedStep::begin_substeps(const StepTooLong& failure) {
    retries_.reset();
    closes_ = dynamic_cast<const StepTooDeep*>(&failure) != nullptr;
}

bool WatchedStep::give_up(const StepTooLong& failure, const StepFailure& last) {
    if (closes_) solver_.solve_to(1.0);
    closes_ = false;
    if (const auto* deep = dynamic_cast<const StepTooDeep*>(&last)) {
        watched_.overlaps->give_up(deep->bodies());
        if (deep_.empty()) deep_ = last.what();
        return true;
    }
    if (!dynamic_cast<const EnergyWatch::Gain*>(&failure)) return false;
    watched_.energy->give_up();
    return true;
}

void WatchedStep::end() {
    retries_.reset();
    if (watched_.overlaps) watched_.overlaps->end();
}

}  // namespace delassus
