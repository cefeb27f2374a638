// SPDX-License-Identifier: BSD-3-Clause
// Bounces at their time within a step; the derivation is in velocity_contacts.cpp.
#include <algorithm>
#include <cmath>

#include "dynamics/velocity_contacts.hpp"

namespace delassus {

bool VelocityContacts::may_bounce() const {
    return std::any_of(rows_.blocks().begin(), rows_.blocks().end(),
                       [](const UnilateralRows::Block& block) { return block.restitution > 0.0; });
}

void VelocityContacts::time_bounces(const Problem& problem, std::span<const double> smooth) {
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const UnilateralRows::Block& block = rows_.blocks()[k];
        Contact& contact = contacts_[k];
        if (!contact.along_normal || block.restitution == 0.0) continue;
        const double gap = contact.resolved_gap(), speed = -contact.approach, drift = (1.0 - theta_) * h_ * speed;
        if (contact.pushed && std::abs(drift) <= 2.0 * std::abs(gap)) continue;  // it corrects
        const double end = problem.D.row_times(static_cast<std::int32_t>(first_row_ + contact.row), smooth.data()) +
                           rows_.rows()[contact.row].rate;
        const auto bounce =
            bounce_within(h_, std::max(contact.gap, 0.0), block.speed, (end - block.speed) / h_, block.restitution);
        if (bounce && bounce->closing > settings_.restitution_speed) {
            contact.bounce = bounce;
            contact.bounces = !contact.pushed || gap > 0.0;
            contact.turns = contact.turns && contact.pushed;
            contact.normal = -bounce->end_speed;
            contact.recovery = 0.0;
        } else if (gap > 0.0 && speed < -settings_.restitution_speed) {
            contact.normal = std::max(gap + drift, 0.0) / (theta_ * h_) - speed;
            contact.recovery = 0.0;
        }
    }
}

template <class Visit>
void VelocityContacts::for_each_bounced(const Solution& solution, const Visit& visit) const {
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const std::size_t first = first_row_ + contacts_[k].row;
        if (contacts_[k].bounce && solution.lambda[first] > 0.0)
            visit(contacts_[k], *contacts_[k].bounce, first, static_cast<std::size_t>(rows_.blocks()[k].cone.rows));
    }
}

bool VelocityContacts::bounced(const Solution& solution) const {
    bool any = false;
    for_each_bounced(solution, [&](const Contact&, const Bounce&, std::size_t, std::size_t) { any = true; });
    return any;
}

void VelocityContacts::add_late_impulse(const Problem& problem, const Solution& solution,
                                        std::vector<double>& momentum) const {
    const auto& D = problem.D;
    for_each_bounced(solution, [&](const Contact& contact, const Bounce& bounce, std::size_t first, std::size_t rows) {
        const double share = std::min(bounce.change / contact.change, 1.0);
        const double late = share * (1.0 - theta_ - bounce.acts / h_);
        for (std::size_t row = first; row < first + rows; ++row)
            for (auto e = D.row_start[row]; e < D.row_start[row + 1]; ++e)
                momentum[static_cast<std::size_t>(D.column[static_cast<std::size_t>(e)])] +=
                    late * D.value[static_cast<std::size_t>(e)] * solution.lambda[row];
    });
}

void VelocityContacts::mark_bounced(const Problem& problem, const Solution& solution, std::vector<char>& marks) const {
    const auto& D = problem.D;
    for_each_bounced(solution, [&](const Contact&, const Bounce&, std::size_t first, std::size_t rows) {
        for (auto e = D.row_start[first]; e < D.row_start[first + rows]; ++e)
            marks[static_cast<std::size_t>(D.column[static_cast<std::size_t>(e)])] = 1;
    });
}

}  // namespace delassus
