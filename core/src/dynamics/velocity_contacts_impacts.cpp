// SPDX-License-Identifier: BSD-3-Clause
// Impacts at their time within a step; the derivation is in velocity_contacts.cpp.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "dynamics/position_error.hpp"
#include "dynamics/row_entries.hpp"
#include "dynamics/velocity_contacts.hpp"
#include "support/frames.hpp"

namespace delassus {

bool VelocityContacts::may_strike() const {
    if (takes_only_) return false;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const Contact& contact = contacts_[k];
        const bool closes = contact.along_normal && !contact.pushed && contact.approach > 0.0;
        if (closes || restitution_of(k) > 0.0) return true;
    }
    return false;
}

void VelocityContacts::take_out_open(Problem& problem) const {
    std::size_t row = first_row_, to = first_row_, cone = bilateral_cones_;
    const auto move = [&](SparseMatrix& matrix) {
        auto& start = matrix.row_start;
        const auto first = start[row], last = start[row + 1], target = start[to];
        std::copy(matrix.column.begin() + first, matrix.column.begin() + last, matrix.column.begin() + target);
        std::copy(matrix.value.begin() + first, matrix.value.begin() + last, matrix.value.begin() + target);
        start[to + 1] = target + last - first;
    };
    const auto cut = [&](SparseMatrix& matrix) {
        matrix.rows = static_cast<std::int32_t>(to);
        matrix.row_start.resize(to + 1);
        matrix.column.resize(static_cast<std::size_t>(matrix.row_start.back()));
        matrix.value.resize(matrix.column.size());
    };
    const bool compliant = problem.E.rows > 0;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const Contact& contact = contacts_[k];
        // What the turn of its rows leaves of the speed of one that pushes does not open it; one that bounced may be
        // open.
        const bool keeps = !contact.along_normal || (contact.pushed && restitution_of(k) == 0.0) ||
                           contact.pushes_on((1.0 - theta_) * h_ * contact.approach);
        if (keeps) problem.cones[cone++] = problem.cones[bilateral_cones_ + k];
        for (std::int32_t i = 0; i < rows_.blocks()[k].cone.rows; ++i, ++row) {
            if (!keeps) continue;
            problem.b[to] = problem.b[row];
            move(problem.D);
            if (compliant) {  // diagonal
                move(problem.E);
                std::fill(problem.E.column.begin() + problem.E.row_start[to],
                          problem.E.column.begin() + problem.E.row_start[to + 1], static_cast<std::int32_t>(to));
            }
            ++to;
        }
    }
    problem.cones.resize(cone);
    problem.b.resize(to);
    cut(problem.D);
    if (compliant) cut(problem.E);
    if (compliant) problem.E.columns = problem.E.rows;
}

std::optional<double> VelocityContacts::collect_rows_at(double time, std::size_t block, Problem& problem) {
    const std::size_t first_contact = rows_.blocks().size() - rows_.contacts().size();
    if (block < first_contact ||
        !system_.collect_contact({*begin_, smooth_, curve_, h_}, time, rows_.contacts()[block - first_contact], then_))
        return std::nullopt;
    auto& D = problem.D;
    const std::size_t first = first_row_ + contacts_[block].row;
    const auto begin = static_cast<std::ptrdiff_t>(D.row_start[first]),
               end = static_cast<std::ptrdiff_t>(
                   D.row_start[first + static_cast<std::size_t>(rows_.blocks()[block].cone.rows)]);
    if (!std::equal(D.column.begin() + begin, D.column.begin() + end, then_.column().begin(), then_.column().end()))
        return std::nullopt;
    std::copy(then_.value().begin(), then_.value().end(), D.value.begin() + begin);
    contacts_[block].row_error = 0.0;
    for (std::size_t i = 0; i < then_.rows().size(); ++i)
        rows_.rows()[contacts_[block].row + i].rate = then_.rows()[i].rate_now;
    return then_.rows().front().gap;
}

// In a smooth motion rows change in proportion to time: with w = τ/(θ h) those at τ are (1 − w) D + w D̄, up to O(h²).
// Beside an angular velocity ω, which has the axes of its body, rows turn with these: exp(−[ω] τ) D and exp([ω] (θ h −
// τ)) D̄ stand in their place. What shapes meet on their way has rows of the meeting at the beginning. Rows that turn by
// φ on the way from D to D̄ are off by ½ w (1 − w) φ² of their length.
bool VelocityContacts::take_rows_at(double time, std::size_t block, Problem& problem) {
    Contact& contact = contacts_[block];
    if (!contact.nearly_as_before && !contact.met_on_the_way) return false;
    const std::size_t first = first_row_ + contact.row;
    const auto rows = static_cast<std::size_t>(rows_.blocks()[block].cone.rows);
    auto& D = problem.D;
    const auto begin = static_cast<std::size_t>(D.row_start[first]);
    const auto entries = static_cast<std::size_t>(D.row_start[first + rows]) - begin;
    const auto then = static_cast<std::size_t>(before_.row_start()[contact.before]);
    if (static_cast<std::size_t>(before_.row_start()[contact.before + rows]) != then + entries ||
        !std::equal(D.column.begin() + static_cast<std::ptrdiff_t>(begin),
                    D.column.begin() + static_cast<std::ptrdiff_t>(begin + entries),
                    before_.column().begin() + static_cast<std::ptrdiff_t>(then)))
        return false;
    const double share = contact.met_on_the_way ? 0.0 : time / (theta_ * h_);
    double change = 0.0, size = 0.0;
    const auto between = [&](std::size_t e, double earlier, double later) {
        const double H = diagonal_[static_cast<std::size_t>(D.column[e])];
        D.value[e] = (1.0 - share) * earlier + share * later;
        change += (later - earlier) * (later - earlier) / H;
        size += D.value[e] * D.value[e] / H;
    };
    for (std::size_t e = 0; e < entries; ++e) {
        if (!axes_.at(D.column, begin + e, begin + entries)) {
            between(begin + e, before_.value()[then + e], D.value[begin + e]);
            continue;
        }
        const std::int32_t column = D.column[begin + e];
        const Eigen::Map<const Eigen::Vector3d> before(&before_.value()[then + e]), middle(&D.value[begin + e]);
        const Eigen::Vector3d earlier = axes_.later(time, column, before),
                              later = axes_.later(time - theta_ * h_, column, axes_.unstretched(column, middle));
        for (Eigen::Index axis = 0; axis < 3; ++axis, ++e) between(begin + e, earlier[axis], later[axis]);
        --e;
    }
    if (size > 0.0) contact.row_error = 0.5 * std::abs(share * (1.0 - share)) * change / size;
    set_rates_at(time, block);
    return true;
}

// Impacts are at an instant, whose rates are those of the prescribed motion then, where the contact is then.
void VelocityContacts::set_rates_at(double time, std::size_t block) {
    const Contact& contact = contacts_[block];
    const auto count = static_cast<std::size_t>(rows_.blocks()[block].cone.rows);
    const std::span rows = std::span(rows_.rows()).subspan(contact.row, count);
    const std::span then = std::span(before_.rows()).subspan(contact.before, count);
    const double share = time / (theta_ * h_);
    bool any = false;
    for (std::size_t i = 0; i < count; ++i) {
        any = any || then[i].rate_now != 0.0 || rows[i].rate_now != 0.0;
        rows[i].rate = then[i].rate_now + share * (rows[i].rate_now - then[i].rate_now);
    }
    const std::size_t first_contact = rows_.blocks().size() - rows_.contacts().size();
    if (!any || block < first_contact) return;
    const std::size_t first_before = before_.blocks().size() - before_.contacts().size();
    ContactPoint point = before_.contacts()[find_before(rows_.blocks()[block].key)->block - first_before];
    const ContactPoint& later = rows_.contacts()[block - first_contact];
    Eigen::Map<Eigen::Vector3d> normal(point.normal.data());
    if (!point.on_the_way) {
        for (std::size_t i = 0; i < 3; ++i) {
            point.point_a[i] += share * (later.point_a[i] - point.point_a[i]);
            point.point_b[i] += share * (later.point_b[i] - point.point_b[i]);
            point.normal[i] += share * (later.normal[i] - point.normal[i]);
        }
        normal.normalize();
    }
    const double begin = middle_.t - theta_ * h_;
    const auto velocity = system_.prescribed_velocity(point, begin, begin + time);
    if (!velocity) return;
    const Eigen::Matrix3d frame = contact_frame(normal);
    for (std::size_t i = 0; i < count; ++i)
        rows[i].rate = frame.col(static_cast<Eigen::Index>(i)).dot(Eigen::Map<const Eigen::Vector3d>(velocity->data()));
}

// Where a contact touches and did not push, its rows stay those of the middle, and its rates become those of the end.
void VelocityContacts::take_rates_of_end(const Contact& contact, const UnilateralRows::Block& block) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.cone.rows); ++i) {
        double& rate = rows_.rows()[contact.row + i].rate;
        rate += (1.0 - theta_) / theta_ * (rate - before_.rows()[contact.before + i].rate);
    }
}

// The turn of a row on the way to the meeting is an acceleration, too: (D̄ − D) v/(θ h). So is the change of its rate:
// those of the beginning and of D̄ are θ h apart. The row of the meeting, which stays, meets at the same time from
// another gap.
void VelocityContacts::time_meetings(Problem& problem, std::span<const double> smooth, std::span<const double> curve,
                                     std::span<const double> last_changes, double last_h) {
    constexpr double faint = 1e-9, settled = 1e-4;
    constexpr int most_attempts = 3;
    smooth_ = smooth.data();
    curve_ = curve;
    if (takes_only_) return;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const UnilateralRows::Block& block = rows_.blocks()[k];
        Contact& contact = contacts_[k];
        double gap = contact.resolved_gap();
        const bool bounces = restitution_of(k) > 0.0;
        if (!contact.along_normal || (!bounces && contact.pushed)) continue;
        const UnilateralRows::Row& later = rows_.rows()[contact.row];
        const UnilateralRows::Row& earlier =
            contact.was_there && !contact.met_on_the_way ? before_.rows()[contact.before] : later;
        const double pull = (later.rate_now - earlier.rate_now) / (theta_ * h_);
        double speed = -contact.approach + earlier.rate_now - earlier.rate;
        if (contact.pushes_on((1.0 - theta_) * h_ * speed)) continue;
        const auto row = static_cast<std::int32_t>(first_row_ + contact.row);
        const auto speed_of = [&](const double* v) {
            return problem.D.row_times(row, v) + rows_.rows()[contact.row].rate;
        };
        const auto acceleration = [&] { return (speed_of(smooth.data()) - speed_of(begin_speeds_)) / h_; };
        double slowest = 0.0;  // impact: by less, bodies that move as one close by rounding, or by what solvers left
        for_each_entry(problem.D, static_cast<std::size_t>(row), 1, [&](std::size_t, std::size_t column, double value) {
            slowest += faint * std::abs(value * begin_speeds_[column]);
        });
        slowest = std::max(slowest, settings_.restitution_speed);
        const double last_pull = last_changes.empty() ? 0.0 : problem.D.row_times(row, last_changes.data());
        const auto closing = [&](double change) { return block.restitution > 0.0 ? std::abs(change) : -change; };
        const auto strikes = [&] {
            return bounces ? speed < -slowest
                           : speed < -h_ * std::max({closing(acceleration()), std::abs(pull), closing(last_pull)}) -
                                         contact.resolution / h_;
        };
        if (!bounces && gap <= 0.0 && !strikes()) {
            if (contact.was_there) take_rates_of_end(contact, block);
            continue;
        }
        const auto meeting_from = [&](double from, double begin, double turning) {
            contact.before_impact = {from, begin, acceleration() + turning};
            return impact_within(h_, contact.before_impact, contact.before_impact.acceleration, restitution_of(k),
                                 contact.turning);
        };
        const double open = std::max(contact.gap, 0.0);
        const double turning =
            contact.met_on_the_way
                ? 0.0
                : pull + (block.speed + contact.approach - later.rate + earlier.rate) / (theta_ * h_);
        contact.turning = bounces ? turning : 0.0;
        const auto meeting = meeting_from(open, speed, turning);
        const double time = meeting ? meeting->meets : h_;
        const double left = meeting ? 0.0 : open + (speed + 0.5 * (acceleration() + turning) * h_) * h_;
        std::optional<Impact> impact;
        const auto take_rows = [&](double then, double gap_then) {
            speed = speed_of(begin_speeds_) + deviation_at(problem, first_row_ + contact.row, then);
            gap = gap_then - (speed + 0.5 * acceleration() * then) * then;
            if (meeting) impact = meeting_from(std::max(gap, 0.0), speed, 0.0);
            contact.turns = false;
        };
        auto rows = RowsOf::Middle;
        double then = time;
        const bool may_strike = meeting && (bounces ? meeting->closing > slowest : strikes());
        for (int attempt = 0; may_strike && attempt < most_attempts; ++attempt) {
            const auto gap_then = collect_rows_at(then, k, problem);
            if (!gap_then) break;
            rows = RowsOf::Meeting;
            take_rows(then, *gap_then);
            if (!impact || std::abs(impact->meets - then) <= settled * h_) break;
            then = impact->meets;
        }
        if (rows == RowsOf::Middle && take_rows_at(time, k, problem)) {
            rows = RowsOf::Between;
            take_rows(time, left);
        }
        if (rows == RowsOf::Middle) impact = meeting_from(open, block.speed, 0.0);
        const double drift = (1.0 - theta_) * h_ * speed;
        if (impact && (bounces ? impact->closing > slowest : strikes())) {
            contact.impact = impact;
            contact.row_error += turn_error(problem.D, contact, rows, then);
            if (impact->again) contact.row_error += std::abs(contact.turning) * (h_ - impact->meets) / impact->change;
            contact.strikes = !contact.pushed || gap > 0.0;
            contact.turns = contact.turns && contact.pushed;
            for (std::size_t i = 0; i < std::min<std::size_t>(block.cone.rows, contact.deviation.size()); ++i)
                contact.deviation[i] = deviation_at(problem, first_row_ + contact.row + i, impact->meets);
            contact.normal = contact.deviation[0] - impact->end_speed;
            contact.recovery = 0.0;
        } else if (gap > 0.0 && (!bounces || strikes())) {
            contact.normal = std::max(gap + drift, 0.0) / (theta_ * h_) - (bounces ? speed : 0.0);
            contact.recovery = 0.0;
        }
    }
    find_struck(problem, last_h);
}

// As a share of the size of its rows. Where a body is at the time τ and how it spins is known but for O(τ³), ¼ h |ω|
// |ω̇| τ² of its turn, if it spins by itself. Else its spin is off by as much as where rows between those of the
// beginning and the middle take it to spin as it does at the beginning: by ½ |ω̇| τ² it is turned otherwise. Rows that
// are those of the middle instead are off by all of the turn in between.
double VelocityContacts::turn_error(const SparseMatrix& D, const Contact& contact, RowsOf rows, double time) const {
    const std::size_t row = first_row_ + contact.row;
    const auto end = static_cast<std::size_t>(D.row_start[row + 1]);
    double change = 0.0, size = 0.0;
    for (auto e = static_cast<std::size_t>(D.row_start[row]); e < end; ++e) {
        const auto column = static_cast<std::size_t>(D.column[e]);
        size += D.value[e] * D.value[e] / diagonal_[column];
        if (!axes_.at(D.column, e, end)) continue;
        using Vector = Eigen::Map<const Eigen::Vector3d>;
        const Vector begin(begin_speeds_ + column), smooth(smooth_ + column), arm(&D.value[e]), H(&diagonal_[column]);
        const double spin_up = 0.5 * time * time * (smooth - begin).norm() / h_;
        const bool curved = !curve_.empty() && !Vector(curve_.data() + column).isZero(0.0);
        const double angle = rows == RowsOf::Middle              ? spin_up + std::abs(time - theta_ * h_) * begin.norm()
                             : rows == RowsOf::Meeting && curved ? 0.5 * h_ * begin.norm() * spin_up
                                                                 : spin_up;
        const double square = arm.cwiseAbs2().cwiseQuotient(H).sum();
        change += angle * angle * square;
        size += square - D.value[e] * D.value[e] / diagonal_[column];
        e += 2;
    }
    return size > 0.0 ? std::sqrt(change / size) : 0.0;
}

double VelocityContacts::deviation_at(const Problem& problem, std::size_t row, double time) const {
    if (curve_.empty()) return 0.0;
    return time * (time - h_) * problem.D.row_times(static_cast<std::int32_t>(row), curve_.data());
}

double VelocityContacts::smooth_acceleration(const Problem& problem, std::size_t row) const {
    const auto number = static_cast<std::int32_t>(row);
    return (problem.D.row_times(number, smooth_) - problem.D.row_times(number, begin_speeds_)) / h_;
}

// Of the impulse P_n of the first answer P_o,n is what a contact would press with if it went on. The rest is of the
// impact, and friction is μ (1 − P_o,n/P_n) P_n besides P_o,t until that is over. Of what other forces change by, what
// slows the row down counts alone: in a stack, where several impacts meet, one that is left faster could gain energy.
bool VelocityContacts::revise_impacts(Problem& problem, const Solution& solution, std::span<const double> changes) {
    constexpr double faint = 1e-9;
    double largest = 0.0;  // impulse of what leaves an impact
    bool any = false;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        Contact& contact = contacts_[k];
        any = strike_when_struck(problem, solution, k) || any;
        if (!acts(contact, solution)) continue;
        if (contact.impact->end_speed > 0.0) largest = std::max(largest, solution.lambda[first_row_ + contact.row]);
        double change = 0.0;
        if (!changes.empty())
            for_each_entry(problem.D, first_row_ + contact.row, 1, [&](std::size_t, std::size_t column, double value) {
                change += value * changes[column] / diagonal_[column];
            });
        if (!(-change * (h_ - contact.impact->meets) > faint * contact.impact->closing)) continue;
        contact.impact = impact_within(h_, contact.before_impact, contact.before_impact.acceleration + change,
                                       restitution_of(k), contact.turning);
        contact.normal = contact.deviation[0] - contact.impact->end_speed;
        any = true;
    }
    if (largest == 0.0) return any;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        Contact& contact = contacts_[k];
        const auto rows = std::min(static_cast<std::size_t>(rows_.blocks()[k].cone.rows), contact.known.size());
        if (rows_.blocks()[k].cone.kind != ConeKind::Friction || contact.goes_on == 0.0) continue;
        const double* impulse = solution.lambda.data() + first_row_ + contact.row;
        double change = 0.0;
        for (std::size_t i = 1; i < rows; ++i)
            change = std::max(change, std::abs(impulse[i] - contact.goes_on * contact.last[i]));
        if (!(change > faint * largest)) continue;
        for (std::size_t i = 1; i < rows; ++i) contact.known[i] += contact.goes_on * contact.last[i];
        const double pressed = contact.goes_on * contact.last[0];
        problem.cones[bilateral_cones_ + k].parameters[0] *= impulse[0] > pressed ? 1.0 - pressed / impulse[0] : 0.0;
        contact.rubs_on = held_through_bounces_ = any = true;
    }
    return any;
}

// An open contact of a body that something strikes at τ closes by what that leaves: b = g(τ)/(h − τ), but no less
// than u⁻: where the contact opens at first, its work P (u⁻ + u⁺)/2 would gain energy.
//
// One that pushed goes on as it did until τ, whether the impact opens it or not: with the impulse P₋ of the step
// before, of size h₋, the impulse τ P₋/h₋ is known, unless impacts had a part in P₋ (find_impulsive()). A block that
// rocks from one edge to the other stands on the first one until then; with P = 0 there, as u⁺ > 0 asks for, the second
// would carry it for the whole step, which takes h g b/k² of its rotation at each impact.
//
// A force between bounds acts until τ as its speed u⁻ says, or where that is 0, as in the step before. From then on it
// has the rest of the step: its bounds are those of h − τ.
//
// Such forces are finite however wide their bounds are, and so is friction without what impacts press: a bounce is over
// before they act. So where something leaves an impact, forces between bounds go on at first as before it, and so does
// friction, if the first answer has another one (revise_impacts()). That gives the impulse of the bounce. With it as a
// known one the step is solved again for what comes after (go_on_after_bounces()). Where what met stays together one
// solve does both: what the impact and what forces press with afterwards add up.
//
// Joints pass what strikes one of their bodies on to the others.
void VelocityContacts::find_struck(Problem& problem, double last_h) {
    const auto& D = problem.D;
    const auto for_each_column = [&](const Contact& contact, const auto& act) {
        for_each_entry(D, first_row_ + contact.row, 1, [&](std::size_t, std::size_t column, double) { act(column); });
    };
    for (const Contact& contact : contacts_) {
        if (!contact.impact || contact.impact->closing <= 0.25 * contact.impact->change) continue;
        struck_.resize(static_cast<std::size_t>(D.columns), HUGE_VAL);
        for_each_column(
            contact, [&](std::size_t column) { struck_[column] = std::min(struck_[column], contact.impact->meets); });
    }
    if (struck_.empty()) return;
    const bool leaves = std::any_of(contacts_.begin(), contacts_.end(), [](const Contact& contact) {
        return contact.impact && contact.impact->end_speed > 0.0;
    });
    for (bool passed_on = true; passed_on;) {
        passed_on = false;
        for (std::size_t row = 0; row < first_row_; ++row) {
            double first = HUGE_VAL;
            for_each_entry(D, row, 1,
                           [&](std::size_t, std::size_t column, double) { first = std::min(first, struck_[column]); });
            for_each_entry(D, row, 1, [&](std::size_t, std::size_t column, double) {
                passed_on = passed_on || first < struck_[column];
                struck_[column] = first;
            });
        }
    }
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        Contact& contact = contacts_[k];
        const double gap = contact.resolved_gap();
        const bool between_bounds = is_between_bounds(k) && last_h > 0.0;
        if (!between_bounds && (!contact.along_normal || contact.impact || (!contact.pushed && !(gap > 0.0)))) continue;
        const double sliding = sliding_speed(k);
        for_each_column(contact,
                        [&](std::size_t column) { contact.struck = std::min(contact.struck, struck_[column]); });
        if (!(contact.struck <= h_)) continue;
        if (!contact.pushed && !between_bounds) {
            const auto found = collect_rows_at(contact.struck, k, problem);
            const double speed =
                found ? problem.D.row_times(static_cast<std::int32_t>(first_row_ + contact.row), begin_speeds_) +
                            rows_.rows()[contact.row].rate
                      : -contact.approach;
            contact.gap_when_struck = std::max(found.value_or(gap - contact.approach * contact.struck), 0.0);
            contact.normal = std::max(contact.gap_when_struck / rest_after(contact.struck, h_), speed);
            continue;
        }
        if (between_bounds) {
            hold_until_struck(problem, k, last_h, sliding, leaves);
        } else if (contact.impulsive || last_h < short_share * h_) {
            continue;
        }
        for (std::size_t i = 0; i < contact.known.size(); ++i)
            contact.known[i] = contact.struck / last_h * contact.last[i];
        contact.goes_on = (h_ - contact.struck) / last_h;
    }
}

// With b = g(τ)/(h − τ) a contact that an impact closes at τ has gone over its gap at the end of the step, and would
// still close: with a part of its impact, and in the next step the rest; with friction the two are not the whole. But
// for its own impulse it closes with s = D diag(H)⁻¹ Dᵀ λ − u⁺. So it meets at τ + g(τ)/s, and if that is in the step,
// strikes. At a body that nothing has struck before it lands: the impulse passes through both, and has no time of its
// own.
bool VelocityContacts::strike_when_struck(const Problem& problem, const Solution& solution, std::size_t block) {
    Contact& contact = contacts_[block];
    const std::size_t row = first_row_ + contact.row;
    bool closed = contact.along_normal && !contact.pushed && !contact.impact && contact.struck < h_ &&
                  rows_.blocks()[block].restitution == 0.0 && solution.lambda[row] > 0.0;
    if (!closed) return false;
    for_each_entry(problem.D, row, 1,
                   [&](std::size_t, std::size_t column, double) { closed = closed && struck_[column] < h_; });
    if (!closed) return false;
    const double end_speed =
        problem.D.row_times(static_cast<std::int32_t>(row), solution.x.data()) + rows_.rows()[contact.row].rate;
    const double closing = mobility_of(problem.D, diagonal_, row) * solution.lambda[row] - end_speed;
    const double meets = contact.struck + contact.gap_when_struck / closing;
    if (!(closing > 0.0 && meets < h_)) return false;
    contact.impact = Impact{.meets = meets, .closing = closing, .change = closing, .acts = meets};
    contact.normal = 0.0;
    contact.strikes = true;
    return true;
}

bool VelocityContacts::acts(const Contact& contact, const Solution& solution) const {
    return contact.impact && solution.lambda[first_row_ + contact.row] > 0.0;
}

bool VelocityContacts::any_impact(const Solution& solution) const {
    return std::any_of(contacts_.begin(), contacts_.end(),
                       [&](const Contact& contact) { return acts(contact, solution); });
}

bool VelocityContacts::any_bounce(const Solution& solution) const {
    for (std::size_t k = 0; k < contacts_.size(); ++k)
        if (rows_.blocks()[k].restitution > 0.0 && acts(contacts_[k], solution)) return true;
    return false;
}

// A contact with restitution that is left alone closes within the step if g + u⁻ t + ½ (u⁺ − u⁻) t²/h = 0 for a t < h.
void VelocityContacts::report_closing(const Contact& contact, StepReport& report) const {
    const double begin = -contact.approach, end = contact.end_speed;
    if (!(contact.gap > 0.0) || contact.gap + 0.5 * h_ * (begin + end) >= -contact.resolution) return;
    const double curvature = (end - begin) / h_;
    const double root = std::sqrt(std::max(begin * begin - 2.0 * curvature * contact.gap, 0.0));
    if (root <= report.impact_speed) return;
    report.impact_speed = root;
    report.impact_time = std::min(2.0 * contact.gap / (root - begin), h_);
}

void note_impact(const UnilateralRows::Block& block, double gap, double approach, bool pushed, double h,
                 double restitution_speed, StepReport& report) {
    const double speed = std::max(std::abs(approach), gap / h), e = block.restitution;
    const bool comes_back = e > 0.0 && -approach > e * restitution_speed;
    if ((pushed && !comes_back) || speed <= report.impact_speed) return;
    report.impact_speed = speed;
    report.impact_time = approach < 0.0 ? h : gap / speed;
}

// Rates are means about h/2 and (1 + θ) h/2.
double VelocityContacts::speed_at_begin(std::size_t row, std::size_t before) const {
    const double rate = before_.rows()[before].rate, change = rows_.rows()[row].rate - rate;
    return before_.speed(before, begin_speeds_) - change / theta_;
}

double VelocityContacts::speed_at_end(const Problem& problem, std::size_t row, std::size_t before,
                                      const double* v) const {
    const double rate = rows_.rows()[row].rate, change = rate - before_.rows()[before].rate;
    return problem.D.row_times(static_cast<std::int32_t>(first_row_ + row), v) + rate +
           (1.0 - theta_) / theta_ * change;
}

// Of the impulse of a contact, less is of forces than it says if it changes the speed of its row, as where it strikes
// or corrects a gap, or if other such impulses press on it, which with D_n diag(H)⁻¹ Σ Dᵀ P would close it. Joints of
// struck bodies pass on what they hold.
void VelocityContacts::find_impulsive(const Problem& problem, const Solution& solution) {
    constexpr double faint = 0.05;  // of what the impulse of the contact changes
    const auto& D = problem.D;
    impulsive_.assign(contacts_.size(), 0);
    impulsive_changes_.assign(static_cast<std::size_t>(D.columns), 0.0);
    const auto add = [&](std::size_t first, std::size_t rows) {
        for_each_entry(D, first, rows, [&](std::size_t row, std::size_t column, double value) {
            impulsive_changes_[column] += value * solution.lambda[row] / diagonal_[column];
        });
    };
    if (!struck_.empty())
        for (std::size_t row = 0; row < first_row_; ++row) {
            bool struck = false;
            for_each_entry(D, row, 1, [&](std::size_t, std::size_t column, double) {
                struck = struck || std::isfinite(struck_[column]);
            });
            if (struck) add(row, 1);
        }
    for (bool any = true; any;) {
        any = false;
        for (std::size_t k = 0; k < contacts_.size(); ++k) {
            const Contact& contact = contacts_[k];
            const std::size_t first = first_row_ + contact.row;
            if (!contact.along_normal || impulsive_[k] != 0 || !(solution.lambda[first] > 0.0)) continue;
            double pressed = 0.0;
            for_each_entry(D, first, 1, [&](std::size_t, std::size_t column, double value) {
                pressed += value * impulsive_changes_[column];
            });
            pressed = std::max(std::abs(pressed), std::abs(contact.end_speed + contact.approach));
            if (!contact.impact && !(pressed > faint * contact.change)) continue;
            impulsive_[k] = any = true;
            add(first, static_cast<std::size_t>(rows_.blocks()[k].cone.rows));
        }
    }
}

}  // namespace delassus
