// SPDX-License-Identifier: BSD-3-Clause
// A consistent start, and which rows of joints are kept.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "delassus/error.hpp"
#include "delassus/timestepper.hpp"
#include "mechanics/kinematic_tree.hpp"
#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::Linkage;

namespace {

/// Rows that are left out may miss by this much: in sizes of their linkage, or in rad. Geometries of six digits stay
/// well below it.
constexpr double most_drift = 1e-3;

/// Rows whose dependence has ended where they have drifted.
constexpr double dependent_after_drift = 1e-2;

/// Ten for a spatial loop; so many that looking costs no more than proportional to the rows where there are many.
std::int64_t steps_between_looks(const Linkage& linkage) {
    const auto rows = static_cast<std::int64_t>(linkage.numbers().size());
    return 10 * (1 + rows * rows / 2000);
}

/// What assembly must reach.
constexpr double assembled_position = 1e-9, assembled_velocity = 1e-7;

}  // namespace

std::vector<std::size_t> MultibodySystem::Implementation::rows_of(const Linkage& linkage, bool kept) const {
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < linkage.numbers().size(); ++i)
        if ((linkage.is_certain(i) || place_of_row[static_cast<std::size_t>(linkage.numbers()[i])] >= 0) == kept)
            rows.push_back(i);
    return rows;
}

void MultibodySystem::Implementation::keep_of(const Linkage& linkage, const std::vector<std::size_t>& rows) {
    for (const auto number : linkage.numbers()) place_of_row[static_cast<std::size_t>(number)] = -1;
    for (const auto row : rows)
        if (!linkage.is_certain(row)) place_of_row[static_cast<std::size_t>(linkage.numbers()[row])] = 0;
    number_rows();
}

void MultibodySystem::Implementation::number_rows() {
    kept_rows.clear();
    for (std::size_t row = 0; row < place_of_row.size(); ++row) {
        if (place_of_row[row] < 0) continue;
        place_of_row[row] = static_cast<std::int32_t>(kept_rows.size());
        kept_rows.push_back(static_cast<std::int32_t>(row));
    }
}

// Starts are held beside the rows. What is wrong is theirs if the rows hold without them; by little, as where
// coordinates of few digits say the same of several joints of a loop, they need not hold.
void MultibodySystem::Implementation::assemble(const Linkage& linkage, const State& given, State& state, Assembly& done,
                                               bool at_start) const {
    const auto rows = rows_of(linkage, true);
    const auto with = [&](const std::vector<std::size_t>& starts) {
        auto all = rows;
        if (at_start) all.insert(all.end(), starts.begin(), starts.end());
        return all;
    };
    if (const auto held = with(linkage.starts()); !linkage.is_rounding(linkage.residual(state, held))) {
        auto left = linkage.assemble_positions(state, held);
        if (held.size() > rows.size() && !(left.value <= assembled_position)) {
            left = linkage.assemble_positions(state, rows);
            const auto missed = linkage.residual(state, linkage.starts());
            if (left.value <= assembled_position && missed.value > most_drift)
                throw InputError(
                    fmt::format("{} cannot be had: where the joints, motors and other starts come nearest to it, it is "
                                "off by {:.3g} rad, or of the mechanism's size of {:.3g} m",
                                linkage.owner_of(missed.row), missed.value, linkage.size()));
        }
        if (!(left.value <= assembled_position))
            throw InputError(fmt::format(
                "the joints do not fit together at t = {:.9g} s: the bodies were moved by up to {:.3g} m and {:.3g} "
                "rad, and {} still misses by {:.3g} of the mechanism's size of {:.3g} m (or in rad)",
                state.t, linkage.displacement(given, state).linear, linkage.displacement(given, state).angular,
                linkage.owner_of(left.row), left.value, linkage.size()));
    }
    if (const auto held = with(linkage.start_rates());
        !Linkage::is_rounding_of_rates(linkage.rate_residual(state, held))) {
        // Where nothing moves in any row, all that adds up in them is rounding of the velocities that were given.
        const auto speed = linkage.speed(given);
        const double fastest = std::max(speed.linear / linkage.size(), speed.angular);
        const auto fits = [&](const Linkage::Residual& left) {
            return std::min(left.share, left.value / fastest) <= assembled_velocity;
        };
        auto left = linkage.assemble_velocities(state, held, at_start);
        if (held.size() > rows.size() && !fits(left)) {
            left = linkage.assemble_velocities(state, rows, at_start);
            const auto missed = linkage.rate_residual(state, linkage.start_rates());
            if (fits(left) && missed.share > most_drift)
                throw InputError(fmt::format(
                    "{} has a rate that cannot be had: with the velocities that fit the joints, motors and other "
                    "starts, it is off by {:.3g} of what adds up in it",
                    linkage.owner_of(missed.row), missed.share));
        }
        if (!fits(left))
            throw InputError(
                fmt::format("no velocities fit the joints and motors at t = {:.9g} s: {} misses by {:.3g} of what "
                            "adds up in it; the mechanism cannot move that way from there",
                            state.t, linkage.owner_of(left.row), left.share));
    }
    // What follows a start of a loop is where it was asked to be.
    if (at_start && linkage.has_loops() && linkage.has_starts()) return;
    note_changes(linkage, given, state, done);
}

void MultibodySystem::Implementation::note_changes(const Linkage& linkage, const State& given, const State& state,
                                                   Assembly& done) {
    const auto moved = linkage.displacement(given, state), faster = linkage.velocity_change(given, state);
    const auto before = linkage.speed(given), after = linkage.speed(state);
    done.displacement = std::max(done.displacement, moved.linear);
    done.rotation = std::max(done.rotation, moved.angular);
    done.velocity = std::max(done.velocity, faster.linear);
    done.angular_velocity = std::max(done.angular_velocity, faster.angular);
    done.position_share = std::max({done.position_share, moved.linear / linkage.size(), moved.angular});
    const auto size_of = [&](const Linkage::Largest& one) {
        return std::max(one.linear, linkage.size() * one.angular);
    };
    const double fastest = std::max(size_of(before), size_of(after));
    if (!(fastest > 0.0)) return;
    done.velocity_share_of_all = std::max(done.velocity_share_of_all, size_of(faster) / fastest);
    done.velocity_share = std::max(done.velocity_share, size_of(linkage.velocity_change(given, state, true)) / fastest);
}

// The angle of a joint is known modulo 2π, and its motor says which value it has.
void MultibodySystem::Implementation::choose_turns_of_motors(State& state) const {
    place(state);
    for (const auto& joint : joints)
        for (const auto& row : joint.rows)
            if (row.angle && row.drive)
                state.q[static_cast<std::size_t>(first_angle + row.angle->counted)] =
                    mechanics::Angle::nearest(row.angle->value(at), row.drive->value(state.t) + row.offset) -
                    row.angle->prescribed_turn(at);
}

const Assembly& MultibodySystem::assemble() {
    auto& self = *implementation_;
    self.must_be_finished();
    self.beside_held.reset();
    self.held_rows.clear();
    if (self.assembly) {
        keep_rows(self.first_kept_rows);
        return *self.assembly;
    }
    auto linkages = Linkage::of(self.bodies, self.joints, self.initial_placements());
    State drawn = initial_state();
    State given = drawn;
    Assembly done;
    // Starts keep the rates of the other joints: what was given of their bodies has to fit them.
    if (std::any_of(linkages.begin(), linkages.end(), [](const Linkage& one) { return one.has_starts(); })) {
        for (const auto& linkage : linkages) {
            linkage.fit_velocities(drawn);
            self.note_changes(linkage, given, drawn, done);
        }
        given = drawn;
    }
    int parts = 1;
    for (const auto& linkage : linkages) parts = std::max(parts, linkage.parts_of_starts());
    for (int k = 1; k <= parts; ++k) {
        const double share = static_cast<double>(k) / parts;
        given = mechanics::with_joint_starts(*this, drawn, given, share);
        for (auto& linkage : linkages) linkage.set_share_of_starts(share);
        if (k == parts) break;
        for (const auto& linkage : linkages) linkage.approach(given);
    }
    self.choose_turns_of_motors(given);
    State state = given;
    for (auto& linkage : linkages) {
        linkage.approach(state);
        const auto rows = linkage.independent_rows(state);
        const bool leaves_out_rows = rows.size() < linkage.numbers().size();
        if (leaves_out_rows) self.keep_of(linkage, rows);
        self.assemble(linkage, given, state, done, true);
        if (!leaves_out_rows) continue;
        const auto left_out = self.rows_of(linkage, false);
        const auto others = [&](std::size_t row) {
            return linkage.owners_of_implying(state, row, self.rows_of(linkage, true));
        };
        if (const auto left = linkage.residual(state, left_out); left.value > most_drift)
            throw InputError(
                fmt::format("the joints do not fit together at t = 0: {} contradicts {}, and misses by {:.3g} of the "
                            "mechanism's size of {:.3g} m (or in rad) where all else holds",
                            linkage.owner_of(left.row), others(left.row), left.value, linkage.size()));
        // Beside all rows: in those left out, speeds that are rounding add up to rounding.
        auto all = self.rows_of(linkage, true);
        all.insert(all.end(), left_out.begin(), left_out.end());
        if (const auto left = linkage.rate_residual(state, all);
            left.share > most_drift && !Linkage::is_rounding_of_rates(left))
            throw InputError(
                fmt::format("no velocities fit the joints and motors at t = 0: {} contradicts {}, and misses by {:.3g} "
                            "of the speed where all else holds",
                            linkage.owner_of(left.row), others(left.row), left.share));
        self.redundant.push_back(std::move(linkage));
    }
    self.carry_nodes(state);
    settle_turns(state);
    self.first_kept_rows = self.kept_rows;
    self.assembled = std::move(state);
    return self.assembly.emplace(done);
}

std::int32_t MultibodySystem::constraint_rows() const {
    implementation_->must_be_finished();
    return static_cast<std::int32_t>(implementation_->place_of_row.size());
}

const std::vector<std::int32_t>& MultibodySystem::kept_rows() const {
    return implementation_->kept_rows;
}

void MultibodySystem::keep_rows(const std::vector<std::int32_t>& rows) {
    auto& self = *implementation_;
    self.must_be_finished();
    const bool ascend = std::adjacent_find(rows.begin(), rows.end(), std::greater_equal<>()) == rows.end();
    if (!rows.empty() && (!ascend || rows.front() < 0 || rows.back() >= constraint_rows()))
        throw InputError(fmt::format("rows that are kept must ascend from 0 to {} at most", constraint_rows() - 1));
    std::fill(self.place_of_row.begin(), self.place_of_row.end(), -1);
    for (const auto row : rows) self.place_of_row[static_cast<std::size_t>(row)] = 0;
    self.number_rows();
    ++self.revision;
}

void MultibodySystem::hold_rows(const std::vector<std::int32_t>& held) {
    auto& self = *implementation_;
    const State start = initial_state();
    std::vector<Linkage> redundant;
    std::vector<std::int32_t> kept;
    for (auto& linkage : Linkage::of(self.bodies, self.joints, self.initial_placements())) {
        linkage.take_as_certain([&](std::int32_t row) { return std::binary_search(held.begin(), held.end(), row); });
        const auto rows = linkage.independent_rows(start);
        for (const auto row : rows)
            if (!linkage.is_certain(row)) kept.push_back(linkage.numbers()[row]);
        if (rows.size() < linkage.numbers().size()) redundant.push_back(std::move(linkage));
    }
    std::sort(kept.begin(), kept.end());
    keep_rows(kept);
    self.held_rows = held;
    self.beside_held = std::move(redundant);
}

bool MultibodySystem::renew_rows(State& state, std::int64_t step) {
    auto& self = *implementation_;
    bool renewed = false;
    for (const auto& linkage : self.beside_held ? *self.beside_held : self.redundant) {
        auto rows = self.rows_of(linkage, true);
        const auto drift = linkage.residual(state, self.rows_of(linkage, false));
        // A method whose steps are long opens all joints alike.
        const bool drifted = drift.value > most_drift && drift.value > 10.0 * linkage.residual(state, rows).value;
        if (drifted) {
            auto needed = linkage.rows_by_rank(state, dependent_after_drift);
            if (needed.size() <= rows.size())
                throw StepFailure(
                    fmt::format("{} contradicts {} now, and misses by {:.3g} of the mechanism's size of {:.3g} m (or "
                                "in rad) where all else holds",
                                linkage.owner_of(drift.row), linkage.owners_of_implying(state, drift.row, rows),
                                drift.value, linkage.size()));
            rows = std::move(needed);
        } else if (step % steps_between_looks(linkage) != 0 || !linkage.better_rows(state, rows)) {
            continue;
        }
        self.keep_of(linkage, rows);
        Assembly done;
        try {
            self.assemble(linkage, State(state), state, done, false);
        } catch (const InputError& error) {
            throw StepFailure(error.what());
        }
        renewed = true;
    }
    if (!renewed) return false;
    self.carry_nodes(state);
    settle_turns(state);
    return true;
}

std::vector<double> MultibodySystem::all_multipliers(const std::vector<double>& kept) const {
    const auto& self = *implementation_;
    std::vector<double> all(self.place_of_row.size(), 0.0);
    for (std::size_t i = 0; i < std::min(kept.size(), self.kept_rows.size()); ++i)
        all[static_cast<std::size_t>(self.kept_rows[i])] = kept[i];
    return all;
}

std::vector<std::string> MultibodySystem::joints_with_rows_left_out() const {
    const auto& self = *implementation_;
    std::vector<std::string> names;
    for (const auto& joint : self.joints)
        for (std::int32_t i = 0; i < joint.row_count(); ++i)
            if (self.place_of(joint, static_cast<std::size_t>(i)) < 0 &&
                !std::binary_search(self.held_rows.begin(), self.held_rows.end(), joint.first_row + i)) {
                names.push_back(joint.parameters.name);
                break;
            }
    return names;
}

}  // namespace delassus
