// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/sleeping.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "delassus/error.hpp"

namespace delassus {

// ---- Falling asleep ----
//
// Parts of the step's problem sleep and wake as a whole: bodies and nodes that contacts, joints, springs or elements
// connect. After a step in which all of a part have been slower than `speed` for at least `time`, their velocities are
// set to zero, and the part is on trial: the next step is solved from rest. A speed x of that step is an acceleration
// times h. The part stands still if no x would grow to `speed` within `time`:
//
//     x ≤ speed · h/time
//
// so a part that is slow only for the moment, or slides ever faster, goes on. If it stands still, x is set to zero.
//
// ---- Sleeping ----
//
// With v = 0 and positions that are kept to the bit, the part's problem is the same in each step that follows, so that
// its solution is: it is left out, and its reactions stay. Whatever could wake it changes the problem: another body
// that comes near or goes, a load or a motor that varies, a step of another size. The identity of the problem, a hash
// of its rows and right-hand sides, reveals the change. What wakes must be quiet for `time` again.

namespace {

/// Values of Unit::rest that are no identities.
constexpr std::uint64_t awake = 0, on_trial = 1;
constexpr std::size_t numbers_of_unit = 3;

}  // namespace

Sleeping::Sleeping(const MultibodySystem& system, const SleepingRule& rule)
    : rule_(rule), unit_of_(static_cast<std::size_t>(system.n())) {
    std::int32_t position = 0;  // bodies, then nodes, as in multibody.hpp
    const auto add = [&](std::int32_t column, std::int32_t velocities, std::int32_t positions) -> Unit& {
        std::fill_n(unit_of_.begin() + column, velocities, static_cast<std::int32_t>(units_.size()));
        Unit unit;
        unit.column = column;
        unit.velocities = velocities;
        unit.position = position;
        unit.positions = positions;
        position += positions;
        return units_.emplace_back(unit);
    };
    for (BodyIndex body = 0; body < system.body_count(); ++body) {
        if (system.body_column(body) < 0) continue;
        const auto& [xx, yy, zz, xy, xz, yz] = system.body(body).inertia;
        Unit& unit = add(system.body_column(body), 6, 7);
        std::size_t next = 0;
        for (const double J : {xx, yy, zz, xy, xz, yz}) unit.inertia[next++] = J / system.body(body).mass;
    }
    for (std::int32_t node = 0; node < system.node_count(); ++node)
        if (system.node_column(node) >= 0) add(system.node_column(node), 3, 3);
}

// 2 T/m: of a body v² + ω̄ · J ω̄/m.
double Sleeping::square_of_speed(const Unit& unit, const double* v) {
    double square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    if (unit.velocities == 3) return square;
    const double* w = v + 3;
    const auto& [xx, yy, zz, xy, xz, yz] = unit.inertia;
    square += xx * w[0] * w[0] + yy * w[1] * w[1] + zz * w[2] * w[2];
    return square + 2.0 * (xy * w[0] * w[1] + xz * w[0] * w[2] + yz * w[1] * w[2]);
}

template <class Visitor>
void Sleeping::for_each(std::span<const std::int32_t> columns, Visitor&& visit) {
    for (std::size_t place = 0; place < columns.size();) {
        Unit& unit = units_[static_cast<std::size_t>(unit_of_[static_cast<std::size_t>(columns[place])])];
        visit(unit);
        place += static_cast<std::size_t>(unit.velocities);
    }
}

void Sleeping::begin_step(double h) {
    h_ = h;
    parts_ = 0;
    for (Unit& unit : units_) unit.part = -1;
}

bool Sleeping::rests(std::span<const std::int32_t> columns, std::uint64_t identity) {
    bool still = true, sleepers = false;
    for_each(columns, [&](Unit& unit) {
        unit.part = parts_;
        still = still && unit.rest == identity;
        sleepers = sleepers || unit.rest > on_trial;
    });
    ++parts_;
    if (sleepers && !still)
        for_each(columns, [&](Unit& unit) {
            unit.rest = awake;
            unit.quiet = 0.0;
        });
    return still;
}

void Sleeping::solved(std::span<const std::int32_t> columns, std::uint64_t identity, std::span<double> x) {
    const double limit = rule_.speed * h_ / rule_.time;
    const double* v = x.data();
    bool all_on_trial = true, still = true;
    for_each(columns, [&](Unit& unit) {
        all_on_trial = all_on_trial && unit.rest == on_trial;
        still = still && square_of_speed(unit, v) <= limit * limit;
        v += unit.velocities;
    });
    const bool asleep = all_on_trial && still;
    for_each(columns, [&](Unit& unit) {
        if (unit.rest == on_trial && !still) unit.quiet = 0.0;
        unit.rest = asleep ? identity : awake;
    });
    if (asleep) std::fill(x.begin(), x.end(), 0.0);
}

void Sleeping::end_step(const State& before, State& now) {
    all_quiet_.assign(static_cast<std::size_t>(parts_), 1);
    for (Unit& unit : units_) {
        if (unit.part < 0) unit.rest = awake;
        if (unit.rest != awake) {
            std::copy_n(before.q.begin() + unit.position, unit.positions, now.q.begin() + unit.position);
        } else {
            const bool slow = square_of_speed(unit, now.v.data() + unit.column) <= rule_.speed * rule_.speed;
            unit.quiet = slow ? unit.quiet + h_ : 0.0;
        }
        if (unit.part >= 0 && (unit.rest != awake || unit.quiet < rule_.time))
            all_quiet_[static_cast<std::size_t>(unit.part)] = 0;
    }
    for (Unit& unit : units_) {
        if (unit.part < 0 || !all_quiet_[static_cast<std::size_t>(unit.part)]) continue;
        unit.rest = on_trial;
        std::fill_n(now.v.begin() + unit.column, unit.velocities, 0.0);
    }
}

std::int64_t Sleeping::count() const {
    return std::count_if(units_.begin(), units_.end(), [](const Unit& unit) { return unit.rest > on_trial; });
}

// For each unit its quiet time and its state in two halves, which a double holds exactly.
std::vector<double> Sleeping::save() const {
    std::vector<double> memory;
    for (const Unit& unit : units_)
        memory.insert(memory.end(), {unit.quiet, static_cast<double>(unit.rest >> 32U),
                                     static_cast<double>(unit.rest & 0xffffffffU)});
    return memory;
}

void Sleeping::load(const std::vector<double>& memory) {
    if (memory.size() != numbers_of_unit * units_.size())
        throw InputError(fmt::format("the memory of sleeping bodies has {} numbers; the system has {} bodies and nodes",
                                     memory.size(), units_.size()));
    auto next = memory.begin();
    for (Unit& unit : units_) {
        unit.quiet = *next++;
        unit.rest = static_cast<std::uint64_t>(*next++) << 32U;
        unit.rest |= static_cast<std::uint64_t>(*next++);
    }
}

}  // namespace delassus
