// SPDX-License-Identifier: BSD-3-Clause
// A step of a given size is a wish for results, not for exactness, where the method estimates its own error. So the
// method takes steps as long as its estimate allows, and what is shown is read off the way of the last one.
//
// Such a step may err by a tenth of the limit. Whoever asks for short steps gets results that are more exact than the
// limit demands, and a tenth costs little: steps of dormand_prince are shorter by 10^{1/5} only, and a state shown
// costs as much as some of its stages.
//
// What could go wrong with steps longer than those asked for:
//
//   - Something short happens within a step and no stage sees it. What time prescribes has corners where it begins and
//     ends (MultibodySystem::next_corner()), at which steps end. What the state brings about, the estimate sees or
//     not, as in any method with chosen steps; so they are at most `most_longer` times as long.
//   - A step ends at a corner and is judged by forces or speeds of beyond. So steps end shortly before, and one of the
//     smallest size passes the corner. Where `cluster_size` corners follow one another at less than `cluster_spacing`
//     steps shown in the mean, as in a table that samples a curve, that would cost more than it saves: there steps are
//     no longer than those shown, and end with them.
//   - A body turns by half a turn or more, so that the difference of two orientations is not the way between them. So
//     none turns by more than `largest_turn` at the speeds of the beginning, in a step that is longer than those shown.
#include "simulation/look_ahead.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "delassus/error.hpp"

namespace delassus {
namespace {

constexpr double most_longer = 20.0;
/// Steps from one to this of those shown end with these: what longer ones save is less than reading them costs. (The
/// control grows slowly; from 1.07 it would come to 1.25.)
constexpr double worth = 1.07;
constexpr int cluster_size = 8;
constexpr double cluster_spacing = 4.0;
constexpr double largest_turn = 1.0;  // rad

}  // namespace

LookAhead::LookAhead(DynamicalSystem& system, const MultibodySystem& bodies, const JointCoordinates* joints,
                     double step, double smallest)
    : system_(system), bodies_(bodies), joints_(joints), step_(step), smallest_(smallest), output_(system) {}

void LookAhead::begin(const State& state) {
    way_.degree = 0;
    way_.end = state;
    way_.multipliers.clear();
}

double LookAhead::largest() {
    if (joints_) joints_->bodies_of(way_.end, front_);
    double fastest = 0.0;
    for (BodyIndex body = 0; body < bodies_.body_count(); ++body) {
        const Vector3 omega = bodies_.velocities(joints_ ? front_ : way_.end, body)[1];
        fastest = std::max(fastest, std::hypot(omega[0], omega[1], omega[2]));
    }
    return std::clamp(largest_turn / fastest, step_, most_longer * step_);
}

bool LookAhead::clustered(double corner) const {
    double last = corner;
    for (int i = 0; i < cluster_size; ++i) last = bodies_.next_corner(last);
    return last - corner < cluster_size * cluster_spacing * step_;
}

AdaptiveStepReport LookAhead::advance(double to, const Timestepper& stepper, AdaptiveStepping& control,
                                      StepSolver& solver) {
    State front = way_.end;
    const double corner = bodies_.next_corner(front.t), before = corner - 0.5 * smallest_;
    AdaptiveStepReport report;
    if (corner - front.t <= step_ && clustered(corner)) {
        control.set_largest(step_);
        report = control.step(front, to, solver);
    } else if (front.t < before) {
        const double longest = largest();
        control.set_largest(longest, step_);
        const double next = std::min(control.next(), longest);
        const bool fits = next >= step_ && next < worth * step_;
        report = control.step(front, fits ? std::min(to, before) : before, solver);
    } else {
        // The size of the next step has nothing to do with this one.
        const std::vector<double> chosen = control.save();
        control.set_largest(smallest_);
        report = control.step(front, corner + 0.5 * smallest_, solver);
        control.load(chosen);
    }
    cut_ = std::abs(front.t - corner) <= smallest_;
    // Other steps are not looked into.
    if (front.t > to) {
        stepper.extend(way_);
    } else {
        way_.degree = 0;
        way_.multipliers = report.step.multipliers;
    }
    way_.end = std::move(front);
    return report;
}

void LookAhead::show(double to, State& state, StepSolver& solver, StepReport& report) {
    output_.at(way_, to, state, solver, report);
}

std::vector<double> LookAhead::multipliers(const State& state, StepSolver& solver) {
    StepReport report;
    return output_.multipliers(way_, state, solver, report);
}

void LookAhead::put_back(Memory memory) {
    way_ = std::move(memory.way);
    advances_ = memory.advances;
}

std::vector<double> LookAhead::save() const {
    std::vector<double> memory = {
        static_cast<double>(advances_), static_cast<double>(way_.degree), static_cast<double>(way_.multipliers.size()),
        way_.degree == 0 ? 0.0 : static_cast<double>(way_.multiplier_powers.size()), way_.end.t};
    const auto put = [&](const std::vector<double>& values) {
        memory.insert(memory.end(), values.begin(), values.end());
    };
    put(way_.end.q);
    put(way_.end.v);
    put(way_.multipliers);
    if (way_.degree == 0) return memory;
    memory.push_back(way_.begin.t);
    put(way_.begin.q);
    put(way_.begin.v);
    put(way_.positions);
    put(way_.velocities);
    put(way_.multiplier_powers);
    return memory;
}

void LookAhead::load(const std::vector<double>& memory) {
    constexpr double most_powers = 100.0;
    std::size_t at = 0;
    const auto one = [&] {
        if (at == memory.size()) throw InputError("what the method had ahead is of another system");
        return memory[at++];
    };
    const auto count = [&](double most) {
        const double number = one();
        if (!(number >= 0.0 && number <= most)) throw InputError("what the method had ahead is damaged");
        return static_cast<std::size_t>(number);
    };
    const auto take = [&](std::vector<double>& to, std::size_t size) {
        if (memory.size() - at < size) throw InputError("what the method had ahead is of another system");
        to.assign(memory.begin() + static_cast<std::ptrdiff_t>(at),
                  memory.begin() + static_cast<std::ptrdiff_t>(at + size));
        at += size;
    };
    const auto positions = static_cast<std::size_t>(system_.position_size()), n = static_cast<std::size_t>(system_.n());
    const double m = system_.m();
    ContinuousExtension way;
    const auto advances = static_cast<std::int64_t>(count(1e18));
    const std::size_t degree = count(most_powers), multipliers = count(m), powers = count(most_powers * m);
    way.degree = static_cast<std::int32_t>(degree);
    way.end.t = one();
    take(way.end.q, positions);
    take(way.end.v, n);
    take(way.multipliers, multipliers);
    if (degree > 0) {
        way.begin.t = one();
        take(way.begin.q, positions);
        take(way.begin.v, n);
        take(way.positions, degree * n);
        take(way.velocities, degree * n);
        take(way.multiplier_powers, powers);
    }
    if (at != memory.size()) throw InputError("what the method had ahead is of another system");
    way_ = std::move(way);
    advances_ = advances;
}

}  // namespace delassus
