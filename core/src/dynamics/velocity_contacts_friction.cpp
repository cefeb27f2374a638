// SPDX-License-Identifier: BSD-3-Clause
// Friction of what slides along a curve.
//
// Friction acts against a sliding velocity whose direction turns in the step. Against that of its end it would be off
// by O(h), and the method of order 1. So the tangential rows of a contact that slides on see the velocity of the end
// turned back to that of θ:
//
//     b_t has |ũ_t⁺| u_θ/|u_θ| − ũ_t⁺ besides,      u_θ = D̄_t ((1 − θ) v + θ ṽ⁺) + r
//
// with the rate r at q̄ itself, as what slides over a surface that turns stays with no point of it. A contact that comes
// to rest in spite of the guess is left with what was turned, which the next step ends.
//
// Where friction could stop a body within the step, the direction of its sliding follows what pulls at it at once, like
// anything stiff: there the end decides, and a guess says little. So it is turned as a whole where the change
// |u_t⁻ − ũ_t⁺|, and that which the friction of all contacts can make, are below half of the speed, and not at all
// where one of them is as large as that.
#include <algorithm>
#include <array>
#include <cmath>

#include "dynamics/row_entries.hpp"
#include "dynamics/velocity_contacts.hpp"

namespace delassus {

namespace {

/// act(column, length of the entries of two rows with the same columns).
template <class Act>
void for_each_length(const SparseMatrix& D, std::size_t row, const Act& act) {
    const auto count = static_cast<std::size_t>(D.row_start[row + 1] - D.row_start[row]);
    const auto first = static_cast<std::size_t>(D.row_start[row]),
               second = static_cast<std::size_t>(D.row_start[row + 1]);
    for (std::size_t e = 0; e < count; ++e)
        act(static_cast<std::size_t>(D.column[first + e]), std::hypot(D.value[first + e], D.value[second + e]));
}

}  // namespace

void VelocityContacts::find_friction_reach(const Problem& problem) {
    friction_reach_.assign(diagonal_.size(), 0.0);
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const Contact& contact = contacts_[k];
        const Cone& cone = rows_.blocks()[k].cone;
        if (!contact.along_normal || cone.kind != ConeKind::Friction || cone.rows != 3 || !(contact.last[0] > 0.0))
            continue;
        const double impulse = cone.parameters[0] * contact.last[0];
        for_each_length(problem.D, first_row_ + contact.row + 1, [&](std::size_t column, double length) {
            friction_reach_[column] += impulse * length / diagonal_[column];
        });
    }
}

void VelocityContacts::set_friction_direction(Problem& problem, const Contact& contact, std::size_t size,
                                              std::span<const double> guess, double end_squares) const {
    constexpr std::size_t rows = 3;
    if (theta_ == 1.0 || size != rows || !contact.along_normal || !contact.pushed || !contact.nearly_as_before ||
        contact.impact || contact.known[1] != 0.0 || contact.known[2] != 0.0)
        return;
    const std::size_t first = first_row_ + contact.row;
    std::array<double, rows> end{}, middle{};
    double begin_squares = 0.0, change = 0.0, middle_squares = 0.0, reach = 0.0;
    for (std::size_t i = 1; i < rows; ++i) {
        const auto row = static_cast<std::int32_t>(first + i);
        const double begin = speed_now(before_, contact.before + i, begin_speeds_);
        end[i] = problem.D.row_times(row, guess.data()) + problem.b[first + i];
        middle[i] = (1.0 - theta_) * problem.D.row_times(row, begin_speeds_) +
                    theta_ * problem.D.row_times(row, in_middle_.data()) + rows_.rows()[contact.row + i].rate_now;
        begin_squares += begin * begin;
        middle_squares += middle[i] * middle[i];
        change += (begin - end[i]) * (begin - end[i]);
    }
    for_each_length(problem.D, first + 1,
                    [&](std::size_t column, double length) { reach += length * friction_reach_[column]; });
    const double speed = std::sqrt(std::min(begin_squares, end_squares));
    const double largest = std::max(std::sqrt(change), reach);
    if (!(2.0 * largest < speed) || middle_squares == 0.0) return;
    const double part = std::min(1.0, 2.0 - 4.0 * largest / speed), scale = std::sqrt(end_squares / middle_squares);
    for (std::size_t i = 1; i < rows; ++i) problem.b[first + i] += part * (scale * middle[i] - end[i]);
}

}  // namespace delassus
