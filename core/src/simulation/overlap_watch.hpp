// SPDX-License-Identifier: BSD-3-Clause
// Steps that leave bodies in one another (internal).
#pragma once

#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/multibody.hpp"
#include "delassus/timestepper.hpp"

namespace delassus {

/// A step that leaves bodies deeper in one another than they were, by more than its accuracy allows.
class DELASSUS_API StepTooDeep : public StepTooLong {
public:
    StepTooDeep(const std::string& sentence, BodyIndex a, BodyIndex b, double depth, double last)
        : StepTooLong(sentence), bodies_(a, b), depth_(depth), last_(last) {}
    /// The pair that is deepest beside what it may be, the lesser number first.
    [[nodiscard]] std::pair<BodyIndex, BodyIndex> bodies() const { return bodies_; }
    /// By what its overlap has grown, m.
    [[nodiscard]] double depth() const { return depth_; }
    /// By what it had grown in the trial before; in the first one it says nothing.
    [[nodiscard]] double last_depth() const { return last_; }

private:
    std::pair<BodyIndex, BodyIndex> bodies_;
    double depth_, last_;
};

/// A step has rows for the contacts that it knows. What bodies meet otherwise, as where they turn or land within it,
/// shows at its end: they overlap more than they did. A step counts as too long then where the overlap has grown by
/// more than the accuracy allows, a share of the extent of the smaller one of both; or than a tenth of half the
/// thickness of the thinner one, beyond which it is soon pushed out on the other side.
class DELASSUS_API OverlapWatch {
public:
    /// system: finished, outlives it. accuracy: a share, > 0. start: of the bodies; h: the first step, s.
    OverlapWatch(MultibodySystem& system, double accuracy, const State& start, double h);

    /// What overlaps at the start by more than the accuracy allows, as a sentence with what to do; empty: nothing.
    [[nodiscard]] const std::string& at_start() const { return at_start_; }

    /// Whether anything does by more than rounding.
    [[nodiscard]] bool any_at_start() const;

    /// Notes the overlaps at the beginning of a step of size h, of the bodies.
    void begin(const State& state, double h, const sdk::Team& team = {}) {
        system_.collect_overlaps(state, h, team, before_);
        now_.clear();
    }
    /// Throws StepTooDeep if they have grown too much at the end of it. h: of the next step.
    void require_within(const State& state, double h, const sdk::Team& team = {});
    /// They come to overlap however short the steps: they are not watched until they have come apart.
    void give_up(std::pair<BodyIndex, BodyIndex> bodies) { given_up_.insert(bodies); }
    /// Which contacts after a step are deeper than the accuracy allows, beside what overlapped at the start, a
    /// sentence; empty: none. What steps let sink in by less than each of them may, adds up.
    [[nodiscard]] std::string too_deep(std::span<const ContactPoint> contacts) const;
    /// Those that are not watched, a then b of each pair, ascending.
    [[nodiscard]] std::vector<BodyIndex> given_up() const;
    void set_given_up(const std::vector<BodyIndex>& pairs);
    /// After a step that was within.
    void end();

private:
    [[nodiscard]] double allowed(const BodyOverlap& pair) const;

    MultibodySystem& system_;
    double accuracy_;
    std::string at_start_;
    std::vector<BodyOverlap> start_;                // of the run's start
    std::vector<BodyOverlap> before_, now_, last_;  // of the step's begin, of the last trial and the one before
    std::set<std::pair<BodyIndex, BodyIndex>> given_up_;
};

}  // namespace delassus
