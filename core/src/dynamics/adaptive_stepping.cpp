// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/adaptive_stepping.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "dynamics/row_entries.hpp"
#include "dynamics/substeps.hpp"

namespace delassus {

// ---- The estimate ----
//
// A method of order p makes a local error of c h^{p+1} in a step of size h, of 2 c (h/2)^{p+1} in its two halves. So
// with the difference δ = log(q_whole⁻¹ ∘ q_halves),
//
//     error of the halves ≈ δ / (2^p − 1)
//
// which needs nothing but the method itself, constraints or not, and is of the method's own order (Hairer, Nørsett,
// Wanner, Solving Ordinary Differential Equations I, sec. II.4). Velocities are of lower order than positions in
// systems with constraints on positions; their differences enter with the factor h (Hairer, Wanner, II, sec. VII.3).
//
// Methods that damp at once may add the estimate to the result, which then is of one order more. For others the sum is
// unstable: with the factor −ρ a step at infinite frequency it has (2^p ρ² + ρ)/(2^p − 1), 1.12 for ρ = 0.8. With
// constraints the sum gains no order: the chord of the first half is not tangential, so that the second half loses
// twice as much speed along the constraint as the first. While contacts push it would undo what they hold.
//
// A method of order p with an embedded one of order p − 1 gives their difference, the error of the latter, c h^p. It
// takes one trial in place of three. The result is that of order p, as with the sum.
//
// What is bounded: with the sum, the error of a step; with an embedded method likewise, by a hundredth of the
// tolerance; without, the error of a step divided by its size. Each way the error at a fixed time is proportional to
// the tolerance, and the estimate to h^{p+1} or h^p. The hundredth makes the error at the end of a run about the
// tolerance: steps of order 5 are long, some hundreds a run, and mechanisms magnify errors by some ten
// (docs/references.md). Where the embedded method is of an order p̂ below p − 1, its error ĉ h^{p̂+1} says more than it
// should: the error at a fixed time falls as h^p, so that the bound is the tolerance (in m and rad) to the power
// (p̂ + 1)/p.
//
// A bound in metres says nothing of a motion that is smaller: a mass on a spring that moves by 1 µm had steps as long
// as the method is stable for, and half its amplitude. So with `of_way` the bound of a coordinate is a share of the
// longest way that it has gone from where it began, and no more than of its size. What moves a thousandth as far as
// another coordinate has that as its way: off the plane of a mechanism there is rounding only.

namespace {

/// Longest and shortest next step, relative to the last.
constexpr double most_growth = 4.0, least_growth = 0.2, safety = 0.9;
/// Of the tolerance, in a step of an embedded method.
constexpr double share_of_step = 0.01;
/// Of an estimate, where a step is longer than `common`.
constexpr double strict = 10.0;
/// Remaining times within this fraction of a step are whole steps that rounding spoiled.
constexpr double rounding_of_step = 1e-9;
/// Of the tolerance: an impact in a step that errs less need not be looked for.
constexpr double faint_impact = 0.1;
/// Of a speed that a contact should not have: what the step errs by, and its halves do not see.
constexpr double share_of_wrong_speed = 0.25;
/// Of the longest way of all coordinates.
constexpr double least_of_ways = 1e-3;
/// Of positions, and of 1 for those of about 0: what they cannot be known better than.
constexpr double rounding_of_positions = 1e-13;
/// Of the longest step: whose error may be made at an edge.
constexpr double share_of_event = 0.01;
/// Of the longest step: what is near for so long is there.
constexpr double moment_of_step = 1e-5;
/// Of sizes: what gaps are resolved to, by which positions of two ways to take a step may differ where bodies touch.
constexpr double rounding_of_gaps = 1e-9;
/// Of the fastest speed: slower ones may be what solves leave, or rounding of the rates of bodies with a motion.
constexpr double rounding_of_speed = 1e-6;

/// act(block, gap, speed at v) for the normal rows.
template <class Act>
void for_each_normal(const UnilateralRows& rows, const std::vector<double>& v, Act act) {
    std::size_t row = 0;
    for (const auto& block : rows.blocks()) {
        if (block.along_normal()) act(block, rows.rows()[row].gap, speed_now(rows, row, v.data()));
        row += static_cast<std::size_t>(block.cone.rows);
    }
}

/// act(block, first row, rows) for what dry friction holds: the tangential rows of contacts, and friction in joints.
template <class Act>
void for_each_sliding(const UnilateralRows& rows, Act act) {
    std::size_t row = 0;
    for (const auto& block : rows.blocks()) {
        const auto size = static_cast<std::size_t>(block.cone.rows);
        const bool dry = block.cone.kind == ConeKind::Box && block.compliance == 0.0;
        if (dry) act(block, row, size);
        if (block.along_normal() && size > 1) act(block, row + 1, size - 1);
        row += size;
    }
}

/// Ascending.
std::vector<std::uint64_t> keys_that_push(const StepReport& report) {
    std::vector<std::uint64_t> keys;
    for (const auto& [key, force] : report.reactions)
        if (force[0] > 0.0) keys.push_back(key);
    std::ranges::sort(keys);
    return keys;
}

}  // namespace

StepControl StepControl::within(double limit, double h) {
    return {.absolute = limit, .initial = h, .smallest = shortest_substep * h, .largest = h, .of_way = true};
}

AdaptiveStepping::AdaptiveStepping(DynamicalSystem& system, Timestepper& stepper, const StepControl& control,
                                   std::string advice)
    : system_(system),
      stepper_(stepper),
      control_(control),
      advice_(std::move(advice)),
      extrapolates_(stepper.damps_at_once() && system.m() == 0),
      embedded_(stepper.has_embedded_error()),
      unilateral_(control.finds_impacts && system.has_unilateral()),
      resolution_(unilateral_ ? rounding_of_gaps : 0.0),
      next_(control.initial) {
    const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
    if (!positive(control.absolute) || !positive(control.unit) || !(control.relative >= 0.0) ||
        !std::isfinite(control.relative))
        throw InputError("a tolerance must be positive and finite");
    if (!positive(control.smallest) || !positive(control.largest) || !(control.smallest <= control.initial) ||
        !(control.initial <= control.largest))
        throw InputError(
            fmt::format("steps must be positive and finite with smallest ≤ initial ≤ largest, not {}, {} and {}",
                        control.smallest, control.initial, control.largest));
    if (!control.sizes.empty() && control.sizes.size() != static_cast<std::size_t>(system.n()))
        throw InputError(fmt::format("{} sizes are given for {} velocities", control.sizes.size(), system.n()));
    if (!std::all_of(control.sizes.begin(), control.sizes.end(), positive))
        throw InputError("sizes of coordinates must be positive and finite");
    if (system.m() > 0 && stepper.reaction_growth() > 1.0 - 1e-6)
        throw Unsupported(
            "with joints a \"tolerance\" or an \"accuracy\" needs a method in which errors of the reactions decay: in "
            "this one they "
            "oscillate for ever, and no step would be short enough; take hht, generalized_alpha or euler_implicit, or "
            "give a fixed \"step\"");
    if (!(control.slow > 0.0)) control_.slow = control.absolute / control.unit;
    control_.of_way = control.of_way && embedded_ && !stepper.damps_at_once();
    if (control_.of_way) gone_.assign(static_cast<std::size_t>(system.n()), 0.0);
    longest_ = way_ = gone_;
    stepper.choose_steps(std::min(control.absolute, control_.slow));
}

double AdaptiveStepping::error_of(const State& begin, const State& whole, const State& halves, double h,
                                  bool touches) const {
    const double share = std::pow(2.0, stepper_.order()) - 1.0;
    std::vector<double> delta(halves.v.size());
    system_.difference(whole.q.data(), halves.q.data(), delta.data());
    double worst = 0.0;
    for (std::size_t i = 0; i < delta.size(); ++i) {
        const double error = std::max(std::abs(delta[i]), h * std::abs(halves.v[i] - whole.v[i])) / share;
        const double speed = std::max(std::abs(begin.v[i]), std::abs(halves.v[i]));
        const double allowed = control_.absolute * size(i) + control_.relative * speed;
        const double of_step = extrapolates_ ? allowed : allowed * h / control_.unit;
        const double ratio = std::max(error - (touches ? resolution_ * size(i) : 0.0), 0.0) / of_step;
        worst = std::isfinite(ratio) ? std::max(worst, ratio) : std::numeric_limits<double>::infinity();
    }
    return worst;
}

double AdaptiveStepping::error_of(const State& begin, const State& end, const EmbeddedError& error, double h) {
    const double exponent = (stepper_.embedded_order() + 1.0) / stepper_.order();
    const bool of_way = control_.of_way && h > (1.0 + rounding_of_step) * control_.smallest;
    double least = 0.0, known = 0.0;
    if (of_way) {
        system_.difference(begin.q.data(), end.q.data(), way_.data());
        for (std::size_t i = 0; i < gone_.size(); ++i) least = std::max(least, least_of_ways * longest_way(i));
        known = rounding_of_positions;
        for (const double position : end.q) known = std::max(known, rounding_of_positions * std::abs(position));
    }
    double worst = 0.0;
    for (std::size_t i = 0; i < error.positions.size(); ++i) {
        const double speed = std::max(std::abs(begin.v[i]), std::abs(end.v[i]));
        const double share = control_.absolute + control_.relative * speed / size(i);
        const double range = of_way ? std::min(std::max(longest_way(i), least), size(i)) : size(i);
        const double allowed = std::max(share_of_step * range * std::pow(share, exponent), known);
        const double ratio = std::max(std::abs(error.positions[i]), h * std::abs(error.velocities[i])) / allowed;
        worst = std::isfinite(ratio) ? std::max(worst, ratio) : std::numeric_limits<double>::infinity();
    }
    return worst;
}

double AdaptiveStepping::longest_way(std::size_t velocity) const {
    return std::max(longest_[velocity], std::abs(gone_[velocity] + way_[velocity]));
}

void AdaptiveStepping::go(const State& begin, const State& end) {
    if (!control_.of_way) return;
    system_.difference(begin.q.data(), end.q.data(), way_.data());
    for (std::size_t i = 0; i < gone_.size(); ++i) {
        longest_[i] = longest_way(i);
        gone_[i] += way_[i];
    }
}

void AdaptiveStepping::extrapolate(const State& whole, State& halves) const {
    const double share = 1.0 / (std::pow(2.0, stepper_.order()) - 1.0);
    std::vector<double> delta(halves.v.size());
    system_.difference(whole.q.data(), halves.q.data(), delta.data());
    for (double& entry : delta) entry *= share;
    system_.increment(halves.q.data(), delta.data(), halves.q.data());
    for (std::size_t i = 0; i < delta.size(); ++i) halves.v[i] += share * (halves.v[i] - whole.v[i]);
}

AdaptiveStepping::Trial AdaptiveStepping::take(const State& begin, double h, StepSolver& solver) {
    solver.forget_misses();
    Trial trial;
    if (embedded_) {
        trial.end = begin;
        stepper_.load(memory_);
        trial.second = stepper_.step(trial.end, h, solver);
        count(trial.second);
        solver.require_usable();
        trial.memory = stepper_.save();
        trial.error = error_of(begin, trial.end, stepper_.embedded_error(), h);
        return trial;
    }
    State whole = begin;
    stepper_.load(memory_);
    trial.whole = stepper_.step(whole, h, solver);
    count(trial.whole);
    trial.end = begin;
    stepper_.load(memory_);
    trial.first = stepper_.step(trial.end, 0.5 * h, solver);
    count(trial.first);
    if (unilateral_) trial.middle = trial.end.v;
    trial.second = stepper_.step(trial.end, 0.5 * h, solver);
    count(trial.second);
    solver.require_usable();
    trial.memory = stepper_.save();
    trial.touches = trial.whole.active_blocks + trial.first.active_blocks + trial.second.active_blocks > 0;
    trial.error = error_of(begin, whole, trial.end, h, trial.touches);
    if (unilateral_) look_at_contacts(begin, trial, h, solver);
    if (extrapolates_ && !trial.touches) extrapolate(whole, trial.end);
    return trial;
}

void AdaptiveStepping::count(const StepReport& report) {
    report_.step.newton_iterations += report.newton_iterations;
}

// ---- Impacts ----
//
// An impact is a jump of velocities, whatever the step: it must not be refined as an error, and at the end of a long
// step it is late by up to h. So steps are cut where a contact or stop closes, faster than the tolerance a unit of
// time; a step of size `smallest` follows, in which the impact happens. What bounces ever sooner, as a ball that comes
// to rest, has impacts closer than `smallest`, and these steps double while nothing else lies between them: time goes
// time. Contacts that close slowly, or pushed already, are part of the smooth motion. So is an impact by which the step
// does not err, since its method takes it at its own time or it does not matter. If that time is in the second half,
// the whole and the halves are one and the same after it, and do not show how a contact that stays turns until the end:
// it must neither open nor close there, by the rows of the end. Nor do they show an impact that another one leads to.
//
// ---- Edges ----
//
// A method takes rows in the middle of a step. Where a body goes over an edge in the last quarter of a step, the
// contact holds it until the end in the whole step and in both halves; in the first quarter, it lets go at once in all
// of them. Their difference is 0, and the step is off by a quarter of its length. So the speeds of contacts are looked
// at by the rows of both ends: what pushed must not open at the end, and what touched at the beginning and never pushed
// must not be gone through. Where there is no edge these speeds are O(h²) for what pushes, and the second comes once,
// where bodies part. An edge is passed once, so that what a short step errs by may be what a hundredth of the longest
// step may.
//
// Where other contacts carry a body than before, as where it goes from one ground to another one with more friction or
// less, forces jump likewise, and in the first or the last quarter of a step the whole and both halves see one of the
// two alone. So where what touches is not the same at both ends, it is asked what acts shortly after each of them, too,
// if nothing strikes there: a change of acceleration a makes a speed wrong by a quarter of a h at most.
//
// ---- Where dry friction turns round ----
//
// A method takes friction by the speed at the end of a step: where the sliding turns round within it, after u₋/|a₋|,
// the friction has its new direction over all of the step. If that is the first half, the whole and both halves do the
// same, and their difference is 0. The end is off by (a₋ − a₊) u₋/|a₋|, at most by the speed before, and at most by
// that after where the turn is in the second half. Or friction stops the sliding at the end of a step, and it goes back
// in the next one: what stops is followed for half a step more. These speeds are taken by the rows of the beginning,
// which other times have not: what rolls seems to slide, at O(h). So what is held is left out: at rest by the rows of
// each end, and by less than friction can do in both halves.

double AdaptiveStepping::impact_step() const {
    constexpr double patience = 8.0;
    return std::min(control_.smallest * std::pow(2.0, std::max(0.0, impacts_ - patience)), control_.largest);
}

double AdaptiveStepping::moment() const {
    return std::max(control_.smallest, moment_of_step * control_.largest);
}

void AdaptiveStepping::look_at_contacts(const State& begin, Trial& trial, double h, StepSolver& solver) {
    const std::vector<double>& v = trial.end.v;
    double fastest = 0.0;
    for (std::size_t i = 0; i < v.size(); ++i) fastest = std::max(fastest, std::abs(v[i]) / size(i));
    trial.slow = control_.slow * std::max(1.0, rounding_of_speed * fastest * control_.unit / control_.absolute);
    pushed_ = keys_that_push(trial.second);
    const auto pushed = [this](const UnilateralRows::Block& block) {
        return std::binary_search(pushed_.begin(), pushed_.end(), block.key);
    };
    const double once = std::min(h / (share_of_event * control_.largest), 1.0);
    const auto note = [&](double speed) {
        const double beyond = speed - resolution_ * control_.slow * control_.unit / (control_.absolute * h);
        trial.error = std::max(trial.error, once * share_of_wrong_speed * beyond / trial.slow);
    };
    system_.collect_unilateral(trial.end, moment(), rows_);
    const bool steady = trial.second.impact_speed <= trial.slow;
    for_each_normal(rows_, v, [&](const UnilateralRows::Block& block, double gap, double speed) {
        if (pushed(block)) {
            if (steady) {
                note(speed);
            } else if (block.restitution == 0.0) {
                note(std::abs(speed));
            }
        } else if (-speed > trial.slow) {
            trial.closes_in = std::min(trial.closes_in, -gap / speed);
        }
    });
    if (!steady || trial.first.impact_speed > trial.slow) return;
    note_turns(begin, trial, h, solver);
    for_each_normal(begin_rows_, v, [&](const UnilateralRows::Block& block, double gap, double speed) {
        if (std::abs(gap) <= system_.gap_resolution() && !pushed(block)) note(-speed);
    });
    if (find_touching(begin_rows_, keys_that_push(trial.first)) == find_touching(rows_, pushed_)) return;
    const double allowed = control_.absolute / control_.unit;
    trial.error = std::max(trial.error, once * share_of_wrong_speed * jump_in(begin, trial, h, solver) / allowed);
}

std::vector<std::uint64_t> AdaptiveStepping::find_touching(const UnilateralRows& rows,
                                                           std::vector<std::uint64_t> pushing) const {
    std::size_t row = 0;
    for (const auto& block : rows.blocks()) {
        if (block.along_normal() && rows.rows()[row].gap <= system_.gap_resolution()) pushing.push_back(block.key);
        row += static_cast<std::size_t>(block.cone.rows);
    }
    std::ranges::sort(pushing);
    const auto repeated = std::ranges::unique(pushing);
    pushing.erase(repeated.begin(), repeated.end());
    return pushing;
}

double AdaptiveStepping::jump_in(const State& begin, const Trial& trial, double h, StepSolver& solver) {
    constexpr double share_of_look = 0.125;
    std::array<std::vector<double>, 4> accelerations;
    const auto set = [&](std::size_t k, const std::vector<double>& from, const std::vector<double>& to, double time) {
        accelerations[k].resize(from.size());
        for (std::size_t i = 0; i < from.size(); ++i) accelerations[k][i] = (to[i] - from[i]) / time;
    };
    set(1, begin.v, trial.middle, 0.5 * h);
    set(2, trial.middle, trial.end.v, 0.5 * h);
    const auto look = [&](std::size_t k, const State& from, std::size_t otherwise) {
        State state = from;
        const StepReport report = stepper_.step(state, share_of_look * h, solver);
        count(report);
        set(k, from.v, state.v, share_of_look * h);
        if (report.impact_speed > trial.slow) accelerations[k] = accelerations[otherwise];
    };
    stepper_.load(trial.memory);
    look(3, trial.end, 2);
    stepper_.load(memory_);
    look(0, begin, 1);
    double worst = 0.0;
    for (std::size_t k = 0; k + 1 < accelerations.size(); ++k)
        for (std::size_t i = 0; i < begin.v.size(); ++i)
            worst = std::max(worst, h * std::abs(accelerations[k + 1][i] - accelerations[k][i]) / size(i));
    return worst;
}

// rows_ are those of trial.end.
void AdaptiveStepping::find_held(const Trial& trial) {
    constexpr double below = 0.999;
    const auto sorted = [](const std::vector<BlockReaction>& reactions) {
        std::vector<const BlockReaction*> result;
        for (const BlockReaction& reaction : reactions) result.push_back(&reaction);
        std::sort(result.begin(), result.end(),
                  [](const auto* one, const auto* other) { return one->key < other->key; });
        return result;
    };
    const std::array halves{sorted(trial.first.reactions), sorted(trial.second.reactions)};
    held_.clear();
    for_each_sliding(rows_, [&](const UnilateralRows::Block& block, std::size_t first, std::size_t rows) {
        double square = 0.0;
        for (std::size_t row = first; row < first + rows; ++row)
            square += std::pow(speed_now(rows_, row, trial.end.v.data()), 2);
        if (!(square <= trial.slow * trial.slow) || rows > 3) return;
        for (const auto& half : halves) {
            const auto found = std::lower_bound(half.begin(), half.end(), block.key,
                                                [](const auto* one, std::uint64_t key) { return one->key < key; });
            if (found == half.end() || (*found)->key != block.key) return;
            const auto& force = (*found)->force;
            if (block.along_normal()) {
                if (!(std::hypot(force[1], force[2]) <= below * block.cone.parameters[0] * force[0])) return;
            } else {
                for (std::size_t i = 0; i < rows; ++i)
                    if (!(force[i] >= below * block.cone.lo[i] && force[i] <= below * block.cone.hi[i])) return;
            }
        }
        held_.push_back(block.key);
    });
    std::sort(held_.begin(), held_.end());
}

void AdaptiveStepping::note_turns(const State& begin, Trial& trial, double h, StepSolver& solver) {
    constexpr double at_rest = 1e-3;
    find_held(trial);
    std::vector<double> after;
    const auto go_on = [&] {
        State state = trial.end;
        count(stepper_.step(state, 0.5 * h, solver));
        after = std::move(state.v);
    };
    // What time prescribes of a row changes the speed that is wanted of a motor, by so much until the end.
    const auto change_of_rate = [&](const UnilateralRows::Block& block, std::size_t row) {
        double change = 0.0;
        if (block.along_normal()) return change;
        for_each_sliding(rows_, [&](const UnilateralRows::Block& other, std::size_t first, std::size_t) {
            if (other.key == block.key) change = rows_.rows()[first].rate_now - begin_rows_.rows()[row].rate_now;
        });
        return change;
    };
    // Of two sliding speeds with these products: what the second may be off by where they oppose each other.
    const auto turned = [](double product, double square, double other_square) {
        return product < 0.0 ? std::sqrt(std::min(square, other_square)) : 0.0;
    };
    for_each_sliding(begin_rows_, [&](const UnilateralRows::Block& block, std::size_t first, std::size_t rows) {
        if (block.along_normal() && !std::binary_search(pushed_.begin(), pushed_.end(), block.key)) return;
        const double rate = change_of_rate(block, first);
        double bb = 0.0, bm = 0.0, be = 0.0, mm = 0.0, me = 0.0, ee = 0.0;  // of begin, middle and end
        for (std::size_t row = first; row < first + rows; ++row) {
            const double b = speed_now(begin_rows_, row, begin.v.data()),
                         m = speed_now(begin_rows_, row, trial.middle.data()) + 0.5 * rate,
                         e = speed_now(begin_rows_, row, trial.end.v.data()) + rate;
            bb += b * b;
            bm += b * m;
            be += b * e;
            mm += m * m;
            me += m * e;
            ee += e * e;
        }
        if (bb <= trial.slow * trial.slow && std::binary_search(held_.begin(), held_.end(), block.key)) return;
        double speed = std::max({bm < 0.0 ? std::sqrt(bb) : 0.0, turned(me, mm, ee), turned(be, bb, ee)});
        if (std::sqrt(mm) > trial.slow && std::sqrt(ee) < at_rest * std::sqrt(mm)) {
            if (after.empty()) go_on();
            double ma = 0.0, aa = 0.0;
            for (std::size_t row = first; row < first + rows; ++row) {
                const double a = speed_now(begin_rows_, row, after.data()) + 1.5 * rate;
                ma += a * (speed_now(begin_rows_, row, trial.middle.data()) + 0.5 * rate);
                aa += a * a;
            }
            speed = std::max(speed, turned(ma, mm, aa));
        }
        trial.error = std::max(trial.error, speed / trial.slow);
    });
}

double AdaptiveStepping::impact_in(const Trial& trial, double h) {
    if (!unilateral_) return std::numeric_limits<double>::infinity();
    if (trial.first.impact_speed > trial.slow) return trial.first.impact_time;
    if (trial.second.impact_speed > trial.slow) return 0.5 * h + trial.second.impact_time;
    if (trial.whole.impact_speed > trial.slow) return trial.whole.impact_time;
    return trial.closes_in < 0.0 ? std::max(h + trial.closes_in, 0.0) : std::numeric_limits<double>::infinity();
}

// Trials from the open side: at speeds that stay, an open end says when the contact closes, and speeds change little in
// a short rest. Half of `smallest` is left out, so that the trial after it is open again.
AdaptiveStepping::Trial AdaptiveStepping::until_impact(const State& begin, double impact, double& h,
                                                       StepSolver& solver) {
    const double close = impact_step();
    double open = 0.0, closed = h, guess = impact - 0.5 * close;
    Trial best;
    while (closed - open > close) {
        if (!(guess > open && guess < closed)) guess = 0.5 * (open + closed);
        Trial trial = take(begin, guess, solver);
        ++report_.rejected;
        impact = impact_in(trial, guess);
        if (std::isfinite(impact)) {
            closed = guess;
            guess = impact - 0.5 * close;
            if (guess > open + 0.9 * (closed - open)) guess = 0.5 * (open + closed);
            continue;
        }
        open = guess;
        best = std::move(trial);
        const double rest = best.closes_in;
        if (rest <= close) break;
        guess = open + rest - 0.5 * close;
    }
    h = open;
    return best;
}

AdaptiveStepReport AdaptiveStepping::take_impact(State& state, double h, double end, StepSolver& solver) {
    stepper_.load(memory_);
    const double remaining = end - state.t;
    report_.h = remaining < h + control_.smallest ? remaining : h;
    report_.impact = true;
    const std::int32_t iterations = report_.step.newton_iterations;
    State after = state;
    solver.forget_misses();
    report_.step = stepper_.step(after, report_.h, solver);
    solver.require_usable();
    report_.step.newton_iterations += iterations;
    impacts_ += 1.0;
    state = std::move(after);
    if (report_.h == remaining) state.t = end;
    return std::move(report_);
}

// ---- The choice ----
//
// After a step with the estimate e (over the tolerance; e₋ that of the step before), and k the power of h in it,
//
//     h ← 0.9 h e^(−0.7/k) e₋^(0.4/k)
//
// (PI control: Gustafsson, ACM TOMS 17, 1991; Hairer, Wanner, II, sec. IV.2). A trial with e > 1 is thrown away and
// tried again with 0.9 h e^(−1/k).

AdaptiveStepReport AdaptiveStepping::step(State& state, double end, StepSolver& solver, double most_solves) {
    memory_ = stepper_.save();
    report_ = {};
    if (unilateral_) system_.collect_unilateral(state, moment(), begin_rows_);
    bool shrunk = false;
    double proposed = std::clamp(next_, control_.smallest, control_.largest);
    std::string failure = advice_;
    while (true) {
        if (report_.step.newton_iterations > most_solves)
            throw StepFailure(
                fmt::format("the step at t = {:.9g} takes more than {:.0f} solves", state.t, most_solves));
        const bool smallest = proposed < control_.smallest;
        const auto fell_below = [&] {
            throw StepFailure(
                fmt::format("the step fell below {:.3g} at t = {:.9g}; {}", control_.smallest, state.t, failure));
        };
        if (smallest && !unilateral_ && !control_.of_way) fell_below();
        const double tried = std::max(proposed, control_.smallest), remaining = end - state.t;
        double h = remaining <= (1.0 + rounding_of_step) * tried ? remaining
                   : remaining < 2.0 * tried                     ? 0.5 * remaining
                                                                 : tried;
        Trial trial;
        try {
            trial = take(state, h, solver);
            const double impact = impact_in(trial, h);
            if (std::isfinite(impact) && (trial.error > faint_impact || trial.missed())) {
                if (impact <= impact_step()) return take_impact(state, impact_step(), end, solver);
                trial = until_impact(state, impact, h, solver);
                // What comes before the impact or what would remain is no step by itself.
                const bool shorter = remaining - h < control_.smallest;
                if (shorter) h = remaining - control_.smallest;
                if (h < control_.smallest) return take_impact(state, h + impact_step(), end, solver);
                if (shorter) trial = take(state, h, solver);
            }
        } catch (const StepFailure& error) {
            if (smallest && impact_step() <= control_.smallest) throw;
            failure = error.what();
            impacts_ = std::max(impacts_ - 2.0, 0.0);  // steps for impacts get shorter as well
            proposed = 0.25 * h;
            shrunk = true;
            ++report_.rejected;
            continue;
        }
        report_.error = strictness(h) * trial.error;
        if (report_.error > 1.0) {
            if (!smallest) {
                const auto shorter = [&](double error) {
                    return h * std::max(safety * std::pow(error, -1.0 / power()), least_growth);
                };
                proposed = std::max(shorter(report_.error), std::min(shorter(trial.error), common_));
                shrunk = true;
                ++report_.rejected;
                continue;
            }
            if (!trial.touches) fell_below();
            // Where friction turns round in the shortest step, speeds err. Of a fast motion that is a small share.
            report_.error /= std::max(fastest_ * control_.unit, 1.0);
        }
        stepper_.load(trial.memory);
        // A step cut by the end or by an impact says less than the one that it was to be.
        const double next = h * growth(trial.error, h, shrunk);
        next_ = std::clamp(h < tried ? std::max(next, tried) : next, control_.smallest, control_.largest);
        last_error_ = std::max(trial.error, 1e-4);
        if (h > impact_step()) impacts_ = 0.0;
        const std::int32_t iterations = report_.step.newton_iterations;
        report_.step = std::move(trial.second);
        report_.step.follow(trial.first);
        report_.step.newton_iterations = iterations;
        report_.h = h;
        go(state, trial.end);
        state = std::move(trial.end);
        for (std::size_t i = 0; i < state.v.size(); ++i) fastest_ = std::max(fastest_, std::abs(state.v[i]) / size(i));
        if (h == remaining) state.t = end;
        return std::move(report_);
    }
}

void AdaptiveStepping::set_largest(double largest, double common) {
    if (!(largest > 0.0)) throw InputError(fmt::format("the longest step is {}; it must be positive", largest));
    control_.largest = std::max(largest, control_.smallest);
    common_ = common;
}

double AdaptiveStepping::power() const {
    if (embedded_) return stepper_.embedded_order() + 1.0;
    return stepper_.order() + (extrapolates_ ? 1.0 : 0.0);
}

double AdaptiveStepping::growth(double error, double last, double most) const {
    return std::clamp(safety * std::pow(std::max(error, 1e-10), -0.7 / power()) * std::pow(last, 0.4 / power()),
                      least_growth, most);
}

// A step longer than `common` has to be allowed by the stricter bound, or else it is that long.
double AdaptiveStepping::growth(double error, double h, bool shrunk) const {
    const double most = shrunk ? 1.0 : most_growth, free = growth(error, last_error_, most);
    if (h * free <= common_) return free;
    return std::max(growth(strict * error, strict * last_error_, most), std::min(free, common_ / h));
}

double AdaptiveStepping::strictness(double h) const {
    return h > (1.0 + rounding_of_step) * common_ ? strict : 1.0;
}

std::vector<double> AdaptiveStepping::save() const {
    std::vector<double> memory = {next_, last_error_, impacts_, fastest_};
    memory.insert(memory.end(), gone_.begin(), gone_.end());
    memory.insert(memory.end(), longest_.begin(), longest_.end());
    return memory;
}

void AdaptiveStepping::load(const std::vector<double>& memory) {
    const std::size_t n = gone_.size();
    if (memory.size() != 4 + 2 * n)
        throw InputError(
            fmt::format("the memory of the step control has {} numbers, not {}", memory.size(), 4 + 2 * n));
    next_ = memory[0];
    last_error_ = memory[1];
    impacts_ = memory[2];
    fastest_ = memory[3];
    const auto ways = memory.begin() + 4;
    gone_.assign(ways, ways + static_cast<std::ptrdiff_t>(n));
    longest_.assign(ways + static_cast<std::ptrdiff_t>(n), memory.end());
}

}  // namespace delassus
