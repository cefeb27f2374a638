// SPDX-License-Identifier: BSD-3-Clause
// By what contacts make a step err, as far as the step tells.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "delassus/sdk/cones.hpp"
#include "dynamics/row_entries.hpp"
#include "dynamics/velocity_contacts.hpp"
#include "problem/cone_kinds.hpp"

namespace delassus {

// With the mean forces F of the step and F₋ of the one before, of size h₋, a force changes at the rate
// r = 2 (F − F₋)/(h + h₋), and is F + ½ h r at the end. Where that is negative nothing pulls in its place: the step
// takes E²/(2 |r|) too little of impulse with E = −F − ½ h r, and so gives a speed that is wrong for as long as the
// motion goes on: it counts as if it were wrong over all of the step.
void VelocityContacts::add_error(const Problem& problem, const Solution& solution, double last_h,
                                 std::vector<double>& error) const {
    const auto& D = problem.D;
    for (const Contact& contact : contacts_) {
        const std::size_t row = first_row_ + contact.row;
        if (!contact.along_normal || !(solution.lambda[row] > 0.0)) continue;
        if (contact.impact || !(contact.last[0] > 0.0)) continue;
        const double force = solution.lambda[row] / h_, rate = 2.0 * (force - contact.last[0] / last_h) / (h_ + last_h);
        const double pulls = -force - 0.5 * h_ * rate;
        if (pulls > 0.0) add_error_of(0.5 * pulls * pulls / -rate, D, row, error);
    }
}

void VelocityContacts::add_error_of(double impulse, const SparseMatrix& D, std::size_t row,
                                    std::vector<double>& error) const {
    for_each_entry(D, row, 1, [&](std::size_t, std::size_t column, double value) {
        error[column] += h_ * std::abs(value) * impulse / diagonal_[column];
    });
}

// An open contact that was to stay open and pushes was closed by an impact at τ on one of its bodies. Without its own
// impulse it would close with s = D diag(H)⁻¹ Dᵀ λ − u⁺ from then on, and meet at τ + (g + u⁻ τ)/s. Or it has an impact
// of its own, after one on another contact of its bodies, and counts on a speed that it will not have. Bodies that rest
// on others are not among them: there impacts have no order.
std::optional<VelocityContacts::SecondImpact> VelocityContacts::second_impact(const Problem& problem,
                                                                              const Solution& solution,
                                                                              std::size_t block) const {
    constexpr double least_part = 1e-6, faint = 1e-6;
    const Contact& contact = contacts_[block];
    const std::size_t row = first_row_ + contact.row;
    double struck = contact.struck;
    if (contact.impact && !struck_.empty())
        for_each_entry(problem.D, row, 1,
                       [&](std::size_t, std::size_t column, double) { struck = std::min(struck, struck_[column]); });
    const double closing = contact.impact ? contact.impact->closing : contact.change - contact.end_speed;
    const double share = contact.impact ? 1.0 : restitution_of(block);
    if (contact.pushed || !(struck < h_) || share == 0.0 || !(solution.lambda[row] > 0.0) || !(closing > 0.0))
        return std::nullopt;
    const double meets = contact.impact ? contact.impact->meets : struck + contact.gap_when_struck / closing;
    if (!(meets < h_) || meets - struck < least_part * h_) return std::nullopt;
    const double own = mobility_of(problem.D, diagonal_, row);
    const bool is_loaded = std::any_of(contacts_.begin(), contacts_.end(), [&](const Contact& other) {
        const std::size_t number = first_row_ + other.row;
        return other.along_normal && other.pushed && !other.impact && number != row && solution.lambda[number] > 0.0 &&
               std::abs(coupling(problem.D, diagonal_, row, number)) > faint * own;
    });
    if (is_loaded) return std::nullopt;
    return SecondImpact{struck, meets, share * closing, contact.change / solution.lambda[row]};
}

// At an impact a contact that pushes can give an impulse of its own cone, besides what forces press it with. An answer
// for a whole step may take more from it: friction that only the weight of the step pays for, or that weight holds what
// the impact lifts. The distance of the change of its impulse from the cone is what forces lent, and the speed after
// the impact is off by what that makes.
double VelocityContacts::lent_impulse(const Solution& solution, std::size_t block, double last_h) const {
    const Contact& contact = contacts_[block];
    const Cone& cone = rows_.blocks()[block].cone;
    const auto rows = static_cast<std::size_t>(cone.rows);
    if (all_bounce_ || !contact.along_normal || !contact.pushed || contact.impulsive || !(contact.struck < h_) ||
        rows > contact.last.size())
        return 0.0;
    std::array<double, 3> change{};
    for (std::size_t i = 0; i < rows; ++i)
        change[i] = solution.lambda[first_row_ + contact.row + i] - h_ / last_h * contact.last[i];
    std::array<double, 3> given = change;
    sdk::project(raw_cone(cone), given.data());
    double square = 0.0;
    for (std::size_t i = 0; i < rows; ++i) square += (change[i] - given[i]) * (change[i] - given[i]);
    return std::sqrt(square);
}

// A step that stays whole is off by such a speed, and in positions as if all through it. So it is where the rows of an
// impulse are.
void VelocityContacts::note_impacts(const Problem& problem, const Solution& solution, double last_h,
                                    StepReport& report) const {
    constexpr double faint = 1e-2;
    std::optional<double> known;
    const auto kinetic = [&] {
        if (!known) {
            std::vector<double> momentum(solution.x.size(), 0.0);
            problem.H.multiply_add(1.0, solution.x.data(), momentum.data());
            known = 0.5 * std::inner_product(momentum.begin(), momentum.end(), solution.x.begin(), 0.0);
        }
        return *known;
    };
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const std::size_t row = first_row_ + contacts_[k].row;
        if (acts(contacts_[k], solution) && !report.error.empty())
            add_error_of(contacts_[k].row_error * solution.lambda[row], problem.D, row, report.error);
        if (const double lent = lent_impulse(solution, k, last_h); lent > 0.0) {
            report.doubtful_speed = std::max(report.doubtful_speed, lent * mobility_of(problem.D, diagonal_, row));
            if (!report.error.empty()) add_error_of(lent, problem.D, row, report.error);
        }
        const auto second = second_impact(problem, solution, k);
        if (!second) continue;
        report.doubtful_speed = std::max(report.doubtful_speed, second->speed);
        const double impulse = second->speed / second->mobility, between = 0.5 * (second->after + second->meets);
        const auto cut_there = [between](double& cut) { cut = cut == 0.0 ? between : std::min(cut, between); };
        cut_there(report.second_impact_cut);
        if (0.5 * impulse * second->speed > faint * kinetic()) cut_there(report.cut);
        if (!report.error.empty()) add_error_of(impulse, problem.D, row, report.error);
    }
}

}  // namespace delassus
