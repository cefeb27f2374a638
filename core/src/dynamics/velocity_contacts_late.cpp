// SPDX-License-Identifier: BSD-3-Clause
// When within a step the impacts act on each velocity.
#include <algorithm>
#include <vector>

#include "dynamics/position_error.hpp"
#include "dynamics/row_entries.hpp"
#include "dynamics/velocity_contacts.hpp"

namespace delassus {

// Of two bodies that touch and fall together the lower one strikes the ground. They may have met by 10⁻⁸ m/s at the
// beginning of the step; the impulse between them then is that of the ground, at its time.
void VelocityContacts::find_passing(const Problem& problem, const Solution& solution) {
    const auto& D = problem.D;
    std::vector<double> fastest(static_cast<std::size_t>(D.columns), 0.0);  // change by an impact, along the chain
    bool any = false;
    for (Contact& contact : contacts_) {
        contact.passes_on = false;
        const std::size_t row = first_row_ + contact.row;
        if (!acts(contact, solution)) continue;
        const double change = contact.impact->change;
        for_each_entry(D, row, 1, [&](std::size_t, std::size_t column, double) {
            fastest[column] = std::max(fastest[column], change);
        });
        contact.passes_on = change < mostly * mobility_of(D, diagonal_, row) * solution.lambda[row];
        any = any || contact.passes_on;
    }
    if (!any) return;
    for (bool passed_on = true; passed_on;) {
        passed_on = false;
        for (std::size_t k = 0; k < contacts_.size(); ++k) {
            const std::size_t row = first_row_ + contacts_[k].row;
            if (!(solution.lambda[row] > 0.0)) continue;
            double most = 0.0;
            for_each_entry(D, row, 1,
                           [&](std::size_t, std::size_t column, double) { most = std::max(most, fastest[column]); });
            for_each_entry(D, row, 1, [&](std::size_t, std::size_t column, double) {
                passed_on = passed_on || fastest[column] < most;
                fastest[column] = most;
            });
        }
    }
    for (Contact& contact : contacts_)
        if (contact.passes_on)
            for_each_entry(D, first_row_ + contact.row, 1, [&](std::size_t, std::size_t column, double) {
                contact.passes_on = contact.passes_on && contact.impact->change < mostly * fastest[column];
            });
}

// An impact at τ changes the velocities by v⁺ − ṽ, with all that holds against it; what presses besides is in ṽ as
// well. So positions, which the step moves by (1 − θ) v + θ v⁺, lack
//
//     x = s (1 − θ − τ/h) h (v⁺ − ṽ)
//
// which is added before what else is off is undone (position_projection.cpp). τ is that of the impacts on a velocity,
// weighed by their impulses. Of a contact that pushed in the step before as much goes on as it pushed with there: s is
// the share of the rest. Masses, joints and contacts that push pass an impact on to velocities on which none acts, and
// with it s and τ. So do contacts whose bodies met at next to no speed, if the impulse is mostly that of a faster
// impact on one of them (find_passing()).
bool VelocityContacts::find_impacts(const Problem& problem, const Solution& solution) {
    if (!any_impact(solution)) return false;
    all_bounce_ = true;
    for (std::size_t k = 0; k < contacts_.size(); ++k)
        all_bounce_ = all_bounce_ && (!acts(contacts_[k], solution) || restitution_of(k) > 0.0);
    const auto& D = problem.D;
    const auto n = static_cast<std::size_t>(D.columns);
    on_velocities_.assign(n, {});
    sums_.assign(n, {});
    found_.clear();
    const auto add = [&](std::size_t column, const OnVelocity& value, double weight) {
        if (on_velocities_[column].share >= 0.0) return;
        Sum& sum = sums_[column];
        if (sum.weight == 0.0) found_.push_back(column);
        sum.weight += weight;
        sum.share += weight * value.share;
        sum.late += weight * value.late;
    };
    const auto settle = [&] {
        const bool any = !found_.empty();
        for (const std::size_t column : found_) {
            const Sum& sum = sums_[column];
            on_velocities_[column].share = sum.share / sum.weight;
            on_velocities_[column].late = sum.late / sum.weight;
        }
        found_.clear();
        return any;
    };
    find_passing(problem, solution);
    for (const Contact& contact : contacts_) {
        const std::size_t first = first_row_ + contact.row;
        if (!acts(contact, solution) || contact.passes_on) continue;
        const double share = std::max(1.0 - contact.last[0] / solution.lambda[first], 0.0);
        const OnVelocity value{share, share * (1.0 - theta_ - contact.impact->acts / h_)};
        for_each_entry(D, first, 1,
                       [&](std::size_t, std::size_t column, double) { add(column, value, solution.lambda[first]); });
    }
    const std::vector<std::size_t> directly = found_;
    settle();
    for (const std::size_t column : directly) on_velocities_[column].alone = true;
    for (std::size_t k = 0; k < contacts_.size(); ++k)
        if (const std::size_t first = first_row_ + contacts_[k].row;
            !acts(contacts_[k], solution) || contacts_[k].passes_on)
            for_each_entry(D, first, static_cast<std::size_t>(rows_.blocks()[k].cone.rows),
                           [&](std::size_t row, std::size_t column, double) {
                               if (solution.lambda[row] != 0.0) on_velocities_[column].alone = false;
                           });
    const auto pass_on = [&](const SparseMatrix& matrix, std::size_t first, std::size_t rows) {
        OnVelocity mean{.share = 0.0};
        double known = 0.0, unknown = 0.0;
        for_each_entry(matrix, first, rows, [&](std::size_t, std::size_t column, double) {
            const OnVelocity& one = on_velocities_[column];
            (one.share >= 0.0 ? known : unknown) += 1.0;
            if (one.share < 0.0) return;
            mean.share += one.share;
            mean.late += one.late;
        });
        if (known == 0.0 || unknown == 0.0) return;
        mean.share /= known;
        mean.late /= known;
        for_each_entry(matrix, first, rows, [&](std::size_t, std::size_t column, double) { add(column, mean, 1.0); });
    };
    do {
        for (std::size_t row = 0; row < n; ++row) pass_on(problem.H, row, 1);
        for (std::size_t row = 0; row < first_row_; ++row) pass_on(D, row, 1);
        for (std::size_t k = 0; k < contacts_.size(); ++k)
            if (solution.lambda[first_row_ + contacts_[k].row] > 0.0)
                pass_on(D, first_row_ + contacts_[k].row, static_cast<std::size_t>(rows_.blocks()[k].cone.rows));
    } while (settle());
    return true;
}

}  // namespace delassus
