// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/impact.hpp"

#include <algorithm>
#include <cmath>

namespace delassus {

// With the acceleration a, the gap g and the speed u at the beginning of the step, the contact meets at
//
//     g + u τ + ½ a τ² = 0,      closing with s = −(u + a τ) = √(u² − 2 a g)
//
// and leaves with w = e s. From then on the acceleration is a'. For a' ≥ 0 that was all. Otherwise it meets again after
// the flight F = 2 w/|a'|, with a speed and hence a next flight of e times the last ones: k flights take F (1 − eᵏ)/(1
// − e). What is left of the step after the last whole flight is t, and then u⁺ = eᵏ w + a' t and g⁺ = eᵏ w t + ½ a' t².
// All flights together take F/(1 − e): if that is over within the step, the contact is at rest, u⁺ = g⁺ = 0.
//
// The corner of a body that spins has the acceleration a' + α, with α = Ḋ v beside that of its row at τ, until the end.
// It stands in the place of a' above, and the row has α (h − τ) less of u⁺.
//
// One impulse that leads there from the motion with a changes the speed by u⁺ − (−s + a (h − τ)), and acts at the time
// that gives the same g⁺:
//
//     −s (h − τ) + ½ a (h − τ)² + (h − τ*) (u⁺ + s − a (h − τ)) = g⁺
//
// (τ* = τ for a single bounce with a' = a; with e = 0 and a' < 0 what then presses the bodies together is in it). Where
// a alone would nearly stop what meets, so small an impulse had to act long before the step: it acts when it meets.
//
// What is flush meets everywhere at once. Where that is the end of the step, rounding lets one corner meet and not
// another one, so that times within `rounding` of it count.
std::optional<Impact> impact_within(double h, const Approach& approach, double after, double restitution,
                                    double turning) {
    constexpr double rounding = 1e-9;
    const auto& [gap, speed, acceleration] = approach;
    const double square = speed * speed - 2.0 * acceleration * gap;
    if (!(square > 0.0)) return std::nullopt;
    Impact impact;
    impact.closing = std::sqrt(square);
    if (speed < 0.0) {
        impact.meets = 2.0 * gap / (impact.closing - speed);
    } else if (acceleration < 0.0) {
        impact.meets = (speed + impact.closing) / -acceleration;
    } else {
        return std::nullopt;
    }
    if (!(impact.meets <= (1.0 + rounding) * h)) return std::nullopt;
    impact.meets = std::min(impact.meets, h);
    const double rest = h - impact.meets;
    double left = rest, leaves = restitution * impact.closing;
    const double curve = after + turning;
    if (curve < 0.0) {
        const double flight = 2.0 * leaves / -curve;
        impact.again = flight < left;
        if (flight <= left * (1.0 - restitution)) {
            leaves = left = 0.0;
        } else if (flight < left) {
            if (restitution < 1.0) {
                const double flights =
                    std::floor(std::log1p(-left * (1.0 - restitution) / flight) / std::log(restitution));
                const double share = std::pow(restitution, flights);
                left = std::max(left - flight * (1.0 - share) / (1.0 - restitution), 0.0);
                leaves *= share;
            } else {
                left -= flight * std::floor(left / flight);
            }
        }
    }
    impact.flight = left;
    impact.end_speed = leaves + curve * left - turning * rest;
    const double end_gap = (leaves + 0.5 * curve * left) * left - 0.5 * turning * rest * rest;
    impact.change = impact.end_speed + impact.closing - acceleration * rest;
    const double alone = (-impact.closing + 0.5 * acceleration * rest) * rest;
    impact.acts =
        impact.change > 0.0 ? std::clamp(h - (end_gap - alone) / impact.change, impact.meets, h) : impact.meets;
    return impact;
}

}  // namespace delassus
