// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/path_follower.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace delassus {

// ---- The length of steps ----
//
// A step after one that took k iterations of Newton's method and in which the tangent turned by α is longer by the
// least of √(4/k) (Ramm 1981), 0.15/α, and 2. A step is halved that fails or that turns by more than 0.5 rad: it may
// have come to another branch.
//
// ---- Limit points and bifurcations ----
//
// Where dμ/ds changes its sign in a step, the load factor has an extremum in it: the root of dμ/ds as a function of the
// step's length, by regula falsi (Illinois). Where the number of negative eigenvalues changes and dμ/ds does not
// vanish, branches cross; that point is found by bisection of the step and by the eigenvalue, and the path goes
// straight on.

namespace {

constexpr double largest_turn = 0.5, wanted_turn = 0.15, wanted_iterations = 6.0;

/// Of a step, when a root counts as found.
constexpr double share_of_step = 1e-13;
constexpr double share_of_count = 1e-8;

}  // namespace

bool PathFollower::root(const LoadPathPoint& from, const LoadPathPoint& to, double length,
                        const std::function<double(const LoadPathPoint&)>& function, Found& found) {
    double a = 0.0, b = length, of_a = function(from), of_b = function(to);
    if (of_b == 0.0) {
        found.point = to;
        found.length = length;
        return true;
    }
    if (of_a * of_b > 0.0) return false;
    constexpr int most = 80;
    int side = 0;
    for (int i = 0; i < most; ++i) {
        double s = (of_b * a - of_a * b) / (of_b - of_a);
        if (!(s > a && s < b)) s = 0.5 * (a + b);
        if (!path_.find(from, s, found.point)) {
            s = 0.5 * (a + b);
            if (!path_.find(from, s, found.point)) return false;
        }
        found.length = s;
        const double value = function(found.point);
        if (value == 0.0 || b - a <= share_of_step * length || std::abs(value) < 1e-13) return true;
        if (value * of_b > 0.0) {
            b = s;
            of_b = value;
            if (side == -1) of_a *= 0.5;
            side = -1;
        } else {
            a = s;
            of_a = value;
            if (side == 1) of_b *= 0.5;
            side = 1;
        }
    }
    return true;
}

bool PathFollower::change_of_count(const LoadPathPoint& from, double length, Found& found) {
    double a = 0.0, b = length;
    while (b - a > share_of_count * length) {
        const double s = 0.5 * (a + b);
        LoadPathPoint middle;
        if (!path_.find(from, s, middle) || middle.negative < 0) return false;
        (middle.negative == from.negative ? a : b) = s;
    }
    if (!path_.find(from, b, found.point)) return false;
    found.length = b;
    // What is counted are ω² below a small −σ. From there to ω² = 0, by the secant of ω² of the critical motion.
    const Vector motion = path_.critical_motion();
    double at_s = path_.square_of(motion), s = b, before = a > 0.5 * length ? 0.9 * b : 1.1 * b;
    LoadPathPoint point;
    if (!path_.find(from, before, point)) return true;
    double at_before = path_.square_of(motion);
    constexpr int most = 4;
    for (int i = 0; i < most && at_s != at_before; ++i) {
        const double next = s - at_s * (s - before) / (at_s - at_before);
        if (!(std::abs(next - b) < length) || !(next > 0.0) || !path_.find(from, next, point)) return true;
        before = s;
        at_before = at_s;
        s = next;
        at_s = path_.square_of(motion);
        found.point = point;
        found.length = s;
        if (std::abs(s - before) <= share_of_count * length) break;
    }
    return true;
}

std::vector<PathFollower::Found> PathFollower::events(const LoadPathPoint& from, const LoadPathPoint& to,
                                                      double length) {
    std::vector<Found> result;
    const bool known = from.negative >= 0 && to.negative >= 0;
    Found limit;
    bool has_limit = from.load_rate * to.load_rate < 0.0 &&
                     root(
                         from, to, length, [](const LoadPathPoint& at) { return at.load_rate; }, limit);
    if (has_limit) {
        limit.event = PathEvent::Limit;
        result.push_back(limit);
    }
    if (!known || from.negative == to.negative) return result;
    if (has_limit && std::abs(from.negative - to.negative) == 1) return result;
    Found change;
    if (!change_of_count(from, length, change)) return result;
    change.event = PathEvent::Bifurcation;
    if (!has_limit || std::abs(change.length - limit.length) > 1e-6 * length) {
        result.push_back(std::move(change));
        std::sort(result.begin(), result.end(), [](const auto& a, const auto& b) { return a.length < b.length; });
    }
    return result;
}

PathStop PathFollower::follow(const LoadPathPoint& start, LoadPathPoint& point) {
    point = start;
    point.arc = 0.0;
    if (on_point) on_point(point, PathEvent::None);
    double length = settings_.first_step / point.load_rate, shortest = 1e-9 * length;
    if (goal(point) >= 0.0) return PathStop::Goal;
    LoadPathPoint next;
    for (int count = 0; count < settings_.most_points;) {
        if (length < shortest) return PathStop::Stuck;
        if (!path_.find(point, length, next) || next.turn > largest_turn) {
            length *= 0.5;
            continue;
        }
        Found end;
        end.length = std::numeric_limits<double>::infinity();
        const bool ends = goal(next) >= 0.0;
        if (ends && !root(point, next, length, goal, end)) {
            length *= 0.5;
            continue;
        }
        for (Found& found : events(point, next, length)) {
            if (found.length >= end.length) break;
            found.point.arc = point.arc + found.point.step;
            if (on_point) on_point(found.point, found.event);
        }
        if (ends) {
            end.point.arc = point.arc + end.point.step;
            point = std::move(end.point);
            if (on_point) on_point(point, PathEvent::None);
            return PathStop::Goal;
        }
        const double by_iterations = std::sqrt(wanted_iterations / std::max(1, next.newton_iterations));
        const double by_turn = next.turn > 0.0 ? wanted_turn / next.turn : 2.0;
        length *= std::clamp(std::min(by_iterations, by_turn), 0.25, 2.0);
        next.arc = point.arc + next.step;
        std::swap(point, next);
        ++count;
        if (on_point) on_point(point, PathEvent::None);
    }
    return PathStop::Points;
}

}  // namespace delassus
