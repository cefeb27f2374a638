// SPDX-License-Identifier: BSD-3-Clause
// Forces between bounds: friction in joints, motors and servos at their limit; and friction in contacts that turns
// round.
//
// A force between the bounds F₋ and F₊ is F₋ while the speed u of its row is above 0, and F₊ while it is below. Where u
// passes 0 at the time τ of the step, the impulse is τ F₋ and that of a force between the bounds from then on:
//
//     P ∈ τ F₋ + (h − τ) [F₋, F₊],      τ = h u⁻/(u⁻ − ũ)
//
// with the speed ũ that the row would have at the end under F₋ alone; likewise for u⁻ < 0. Bounds of h [F₋, F₊] would
// change the speed at the end by τ (F₊ − F₋)/m at every turn, which makes the method one of order 1. Where the row then
// slides the other way under F₊, |u⁻ − ũ| is more than h (F₊ − F₋)/m. With less it rests from τ on, as it does by the
// bounds h [F₋, F₊]: these stay.
//
// Friction in a contact that turns round against its sliding velocity u_t⁻ likewise (`once`, which knows ũ): until τ it
// is −μ (τ/h) P_n u_t⁻/|u_t⁻|, with the P_n of the step before, if that is of forces, a known impulse; what is left has
// the cone of μ (1 − τ/h).
#include <algorithm>
#include <cmath>

#include "dynamics/row_entries.hpp"
#include "dynamics/velocity_contacts.hpp"

namespace delassus {

bool VelocityContacts::is_between_bounds(std::size_t block) const {
    const Cone& cone = rows_.blocks()[block].cone;
    return cone.kind == ConeKind::Box && cone.rows == 1 && std::isfinite(cone.lo[0]) && std::isfinite(cone.hi[0]);
}

double VelocityContacts::sliding_speed(std::size_t block) const {
    const Contact& contact = contacts_[block];
    if (!is_between_bounds(block) || contact.servo || !contact.was_there || contact.struck <= h_) return 0.0;
    return speed_at_begin(contact.row, contact.before);
}

bool VelocityContacts::slides(const Problem& problem, std::size_t block, double speed) const {
    const std::size_t row = first_row_ + contacts_[block].row;
    return std::abs(speed) > faint_impulse(problem, block) * mobility_of(problem.D, diagonal_, row);
}

double VelocityContacts::faint_impulse(const Problem& problem, std::size_t block) const {
    constexpr double share = 1e-3;
    const Cone& cone = problem.cones[bilateral_cones_ + block];
    return share * (cone.hi[0] - cone.lo[0]);
}

bool VelocityContacts::any_turns_round(const Problem& problem, const Solution& solution) const {
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const double before = sliding_speed(k);
        if (before == 0.0) continue;
        const Cone& cone = problem.cones[bilateral_cones_ + k];
        const double own = before > 0.0 ? cone.lo[0] : cone.hi[0];
        if (slides(problem, k, before) &&
            std::abs(solution.lambda[first_row_ + contacts_[k].row] - own) > faint_impulse(problem, k))
            return true;
    }
    return false;
}

void VelocityContacts::let_slide_on(Problem& problem) const {
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const double before = sliding_speed(k);
        Cone& cone = problem.cones[bilateral_cones_ + k];
        if (before > 0.0) cone.hi = cone.lo;
        if (before < 0.0) cone.lo = cone.hi;
    }
}

void VelocityContacts::time_turns(Problem& problem, std::span<const double> sliding, double last_h) {
    const auto slides_back = [&](std::size_t row, double change, double both) {
        return change > both * mobility_of(problem.D, diagonal_, first_row_ + row);
    };
    axes_.turn(sliding, h_, theta_, in_begin_, in_middle_);
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        Contact& contact = contacts_[k];
        Cone& cone = problem.cones[bilateral_cones_ + k];
        const auto end_speed = [&](std::size_t i) {
            return speed_at_end(problem, contact.row + i, contact.before + i, in_middle_.data());
        };
        if (const double before = sliding_speed(k); before != 0.0) {
            const double after = end_speed(0);
            if (!(before * after < 0.0) || !slides_back(contact.row, std::abs(before - after), cone.hi[0] - cone.lo[0]))
                continue;
            const double share = before / (before - after);  // τ/h
            (before > 0.0 ? cone.hi : cone.lo)[0] -= share * (before > 0.0 ? 1.0 : -1.0) * (cone.hi[0] - cone.lo[0]);
            continue;
        }
        const bool stays = contact.pushed && !contact.impulsive && contact.was_there && !contact.impact &&
                           !(contact.known[0] > 0.0) && last_h > 0.0;
        if (cone.kind != ConeKind::Friction || !stays) continue;
        const auto axes = static_cast<std::size_t>(cone.rows) - 1;
        std::array<double, 2> before{};
        double squares = 0.0, along = 0.0;
        for (std::size_t i = 0; i < axes; ++i) {
            before[i] = speed_at_begin(contact.row + 1 + i, contact.before + 1 + i);
            squares += before[i] * before[i];
            along += before[i] * end_speed(1 + i);
        }
        if (!(along < 0.0)) continue;
        const double size = std::sqrt(squares), force = cone.parameters[0] * contact.last[0] * h_ / last_h;
        if (!slides_back(contact.row + 1, size - along / size, 2.0 * force)) continue;
        const double share = squares / (squares - along);  // τ/h
        for (std::size_t i = 0; i < axes; ++i) contact.known[1 + i] = -share * force * before[i] / size;
        cone.parameters[0] *= 1.0 - share;
    }
}

void VelocityContacts::add_known_impulses(Problem& problem) const {
    for (const Contact& contact : contacts_)
        for (std::size_t i = 0; i < contact.known.size(); ++i)
            if (contact.known[i] != 0.0)
                for_each_entry(problem.D, first_row_ + contact.row + i, 1,
                               [&](std::size_t, std::size_t column, double value) {
                                   problem.a[column] += value * contact.known[i];
                               });
}

void VelocityContacts::add_known_impulses(std::vector<double>& lambda) const {
    for (const Contact& contact : contacts_)
        for (std::size_t i = 0; i < contact.known.size(); ++i)
            if (contact.known[i] != 0.0) lambda[first_row_ + contact.row + i] += contact.known[i];
}

void VelocityContacts::hold_until_struck(Problem& problem, std::size_t block, double last_h, double sliding,
                                         bool leaves) {
    Contact& contact = contacts_[block];
    Cone& cone = problem.cones[bilateral_cones_ + block];
    const double impulse =
        slides(problem, block, sliding) ? (sliding > 0.0 ? cone.lo : cone.hi)[0] : contact.last[0] * h_ / last_h;
    contact.last[0] = last_h / h_ * std::clamp(impulse, cone.lo[0], cone.hi[0]);
    if (!leaves) return give_rest_of_step(problem, block);
    cone.lo[0] = cone.hi[0] = (h_ - contact.struck) / last_h * contact.last[0];
    held_through_bounces_ = true;
}

void VelocityContacts::give_rest_of_step(Problem& problem, std::size_t block) const {
    const Contact& contact = contacts_[block];
    const Cone& own = rows_.blocks()[block].cone;
    Cone& cone = problem.cones[bilateral_cones_ + block];
    const double rest = rest_after(contact.struck, h_);
    cone.lo[0] = rest * own.lo[0];
    cone.hi[0] = rest * own.hi[0];
    if (!contact.servo) return;
    problem.E.value[static_cast<std::size_t>(problem.E.row_start[first_row_ + contact.row])] =
        contact.servo->compliance(contact.struck);
}

// What bounced may come back as fast as it left, by which its gap is closed again.
bool VelocityContacts::go_on_after_bounces(Problem& problem, const Solution& solution) {
    if (!held_through_bounces_) return false;
    held_through_bounces_ = false;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        Contact& contact = contacts_[k];
        if (is_between_bounds(k) && contact.goes_on != 0.0) give_rest_of_step(problem, k);
        if (contact.rubs_on) {
            for (std::size_t i = 1; i < contact.known.size(); ++i)
                contact.known[i] -= contact.goes_on * contact.last[i];
            problem.cones[bilateral_cones_ + k].parameters[0] = rows_.blocks()[k].cone.parameters[0];
            contact.rubs_on = false;
        }
        if (!acts(contact, solution) || !(contact.impact->end_speed > 0.0)) continue;
        std::copy_n(solution.lambda.begin() + static_cast<std::ptrdiff_t>(first_row_ + contact.row),
                    std::min(static_cast<std::size_t>(rows_.blocks()[k].cone.rows), contact.known.size()),
                    contact.known.begin());
        contact.normal = contact.impact->change - contact.impact->closing;
    }
    return true;
}

double VelocityContacts::share_of_rest(const Problem& problem, const Solution& solution) const {
    double sum = 0.0, weight = 0.0;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const Cone& cone = problem.cones[bilateral_cones_ + k];
        if (contacts_[k].goes_on == 0.0 || (cone.kind != ConeKind::Friction && !is_between_bounds(k))) continue;
        const double* impulse = solution.lambda.data() + first_row_ + contacts_[k].row;
        double size = std::abs(impulse[0]), bound = 0.0;
        if (cone.kind == ConeKind::Friction) {
            size = cone.rows > 2 ? std::hypot(impulse[1], impulse[2]) : std::abs(impulse[1]);
            bound = cone.parameters[0] * impulse[0];
        } else {
            bound = impulse[0] > 0.0 ? cone.hi[0] : -cone.lo[0];
        }
        if (!(bound > 0.0)) continue;
        sum += size * std::min(size / bound, 1.0);
        weight += size;
    }
    return weight > 0.0 ? sum / weight : 0.0;
}

}  // namespace delassus
