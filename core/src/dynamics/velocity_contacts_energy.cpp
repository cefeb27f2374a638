// SPDX-License-Identifier: BSD-3-Clause
// What contacts, stops and forces between bounds do to the energy in a step.
#include <cmath>

#include "dynamics/velocity_contacts.hpp"

namespace delassus {

// What acted until an impact on others did so at the speeds of the beginning, what acts from then on at those of the
// end.
double VelocityContacts::work_of_block(std::size_t block, const Problem& problem, const Solution& solution,
                                       std::span<const double> mean) const {
    const Contact& contact = contacts_[block];
    double sum = 0.0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(rows_.blocks()[block].cone.rows); ++i) {
        const std::size_t row = contact.row + i;
        const double known = contact.known_impulse(i);
        const double rest = solution.lambda[first_row_ + row], impulse = known + rest;
        if (known == 0.0 && rest == 0.0) continue;
        const auto row_of_problem = static_cast<std::int32_t>(first_row_ + row);
        const double rate = mean_rate(contact, i);
        double speed = problem.D.row_times(row_of_problem, mean.data()) + rate;
        if (contact.goes_on != 0.0) {
            const double begin = problem.D.row_times(row_of_problem, begin_speeds_) + rate;
            sum += known * begin + rest * (speed - (1.0 - theta_) * begin) / theta_;
            continue;
        }
        if (contact.impact && i == 0) {
            speed = 0.5 * contact.impact->change - contact.impact->closing;
        } else if (contact.impact) {
            speed += contact.deviation_of(i) + 0.5 * (contact.impact->meets - contact.impact->flight) *
                                                   smooth_acceleration(problem, first_row_ + row);
        }
        sum += impulse * speed;
    }
    return sum;
}

/// That of the meeting, or the mean of the step.
double VelocityContacts::mean_rate(const Contact& contact, std::size_t i) const {
    if (contact.servo) return 0.0;
    const bool of_step = contact.was_there && !contact.impact;
    return of_step ? before_.rows()[contact.before + i].rate : rows_.rows()[contact.row + i].rate;
}

double VelocityContacts::work(const Problem& problem, const Solution& solution, std::span<const double> mean) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < contacts_.size(); ++k)
        if (contacts_[k].along_normal) sum += work_of_block(k, problem, solution, mean);
    return sum;
}

// By the rates of the beginning and of q̄, at (1 − θ) h: means over the step are those of a point of the other body, and
// what rolls passes along it. Where q̄ is the beginning, the mean says how they change.
std::array<double, 2> VelocityContacts::speeds_at_ends(const Problem& problem, std::size_t row,
                                                       std::size_t before) const {
    const auto& [gap, mean, rate] = before_.rows()[before];
    const double change = theta_ < 1.0 ? (rows_.rows()[row].rate_now - rate) / (1.0 - theta_) : 2.0 * (mean - rate);
    const auto of_problem = static_cast<std::int32_t>(first_row_ + row);
    return {before_.speed(before, begin_speeds_) - mean + rate,
            problem.D.row_times(of_problem, in_middle_.data()) + rate + change};
}

// What touches a body with a given motion and goes on has u_n = 0, and slides at u_t = (u⁻ + u⁺)/2 in the mean. P·u is
// what it takes, and the rest of P·D v̄ is supplied. The speeds of both ends are extrapolated; what u⁺ differs by from
// D v⁺ + b, the speed of the law, is what nobody knows of u. At an instant P·r is supplied, and nobody knows by how
// much r changes within the step.
VelocityContacts::Account VelocityContacts::account(const Problem& problem, const Solution& solution,
                                                    std::span<const double> mean) {
    Account account;
    if (contacts_.empty()) return account;
    const bool driven = system_.is_driven();
    if (driven) axes_.turn(solution.x, h_, theta_, in_begin_, in_middle_);
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const Contact& contact = contacts_[k];
        const double work = work_of_block(k, problem, solution, mean);
        if (!driven) {
            account.work += work;
            continue;
        }
        if (contact.servo) {
            account.supplied += work;
            account.turnover += std::abs(work);
            continue;
        }
        const bool goes_on = contact.nearly_as_before && !contact.impact && contact.goes_on == 0.0;
        double of_rates = 0.0, of_slide = 0.0, doubt = 0.0;
        for (std::size_t i = 0; i < static_cast<std::size_t>(rows_.blocks()[k].cone.rows); ++i) {
            const std::size_t row = contact.row + i, before = contact.before + i;
            const double impulse = solution.lambda[first_row_ + row] + contact.known_impulse(i);
            const double by_rate = impulse * mean_rate(contact, i);
            of_rates += by_rate;
            account.turnover += std::abs(by_rate);
            if (!goes_on) {
                if (contact.was_there)
                    doubt += std::abs(impulse * (rows_.rows()[row].rate_now - before_.rows()[before].rate_now));
            } else if (!contact.along_normal || i > 0) {
                const auto [begin, end] = speeds_at_ends(problem, row, before);
                const auto of_problem = static_cast<std::int32_t>(first_row_ + row);
                const double by_law = problem.D.row_times(of_problem, solution.x.data()) + problem.b[first_row_ + row];
                of_slide += 0.5 * impulse * (begin + end);
                doubt += std::abs(impulse * (end - by_law));
            }
        }
        const double taken = goes_on && of_rates != 0.0 ? of_slide : work;
        account.work += taken;
        account.supplied += work - of_rates - taken;
        if (of_rates != 0.0) account.doubt += doubt;
    }
    return account;
}

}  // namespace delassus
