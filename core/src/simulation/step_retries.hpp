// SPDX-License-Identifier: BSD-3-Clause
// What helps a step that leaves bodies in one another, but shorter steps (internal).
#pragma once

#include <optional>
#include <set>
#include <span>
#include <utility>

#include "delassus/multibody.hpp"
#include "delassus/step_solver.hpp"
#include "simulation/overlap_watch.hpp"

namespace delassus {

/// Bodies that come to overlap though they had no contact met on a way that the step's own reactions turned them to.
/// The same step has rows for these then (MultibodySystem::expect_end()), and again for what those lead to. A pair with
/// rows that overlaps was solved too loosely, which a closer solve shows; or its rows turn within the step, and shorter
/// steps are due. So they are where there is restitution, which wants the speed of each meeting. Ends with what it
/// asked for.
class StepRetries {
public:
    /// expects: whether rows for pairs without a contact help.
    StepRetries(MultibodySystem& system, StepSolver& solver, bool expects)
        : system_(system), solver_(solver), expects_(expects) {}
    StepRetries(const StepRetries&) = delete;
    StepRetries& operator=(const StepRetries&) = delete;
    ~StepRetries();

    /// Has the next trial go better. contacts: those of this one; end: where it led the bodies. Throws the failure of
    /// the first trial where nothing is left to try.
    void prepare(const StepTooDeep& failure, std::span<const ContactPoint> contacts, const State& end);
    /// Throws that of the first trial, if there was one.
    void give_up() const;

private:
    [[nodiscard]] bool expect(const StepTooDeep& failure, std::span<const ContactPoint> contacts, const State& end);
    [[nodiscard]] bool solve_closer(const StepTooDeep& failure);

    MultibodySystem& system_;
    StepSolver& solver_;
    bool expects_;
    std::optional<StepTooDeep> first_;  // the failure of the first trial
    std::set<std::pair<BodyIndex, BodyIndex>> expected_;
    double share_ = 1.0;
};

}  // namespace delassus
