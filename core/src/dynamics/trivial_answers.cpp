// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/trivial_answers.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

namespace delassus {

namespace {

double sum_of(const Communicator& run, double own) {
    run.sum(std::span(&own, 1));
    return own;
}
bool all_of(const Communicator& run, bool own) {
    double missing = own ? 0.0 : 1.0;
    run.max(std::span(&missing, 1));
    return missing == 0.0;
}

/// Whether no reactions are within all bounds.
bool hold_zero(std::span<const Cone> cones) {
    return std::ranges::all_of(cones, [](const Cone& cone) {
        return std::ranges::all_of(cone.lo, [](double bound) { return bound <= 0.0; }) &&
               std::ranges::all_of(cone.hi, [](double bound) { return bound >= 0.0; });
    });
}

// What dry friction stops loses a share of its speed in each step that is as small as the tolerance, until the squares
// of all numbers vanish and no error can be measured any more. Far above that it counts as rest.
bool is_at_rest(const Prepared& problem) {
    constexpr double nothing = 1e-100;
    const auto vanish = [](std::span<const double> values) {
        return std::ranges::all_of(values, [](double value) { return std::abs(value) < nothing; });
    };
    return vanish(problem.a()) && vanish(problem.b()) && hold_zero(problem.cones());
}

}  // namespace

// A mechanism that falls freely does not move its rows, whether they are joints or contacts between its bodies. What
// D x + b is then comes from the rounding of x = H⁻¹ a, and errors relative to it say nothing. |S D x| ≤ √m ‖x‖_H with
// ‖x‖_H = √(aᵀx), of which √(aᵀ diag(H)⁻¹ a) is a first guess. Rows that move by less than 10⁻¹² of that are still.
double share_of_rows(const Prepared& problem) {
    const std::span<const double> a = problem.a();
    double twice_energy = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (const double mass = problem.diagonal(i); mass > 0.0) twice_energy += a[i] * a[i] / mass;
    twice_energy = sum_of(problem.communicator(), twice_energy);
    const auto rows = static_cast<double>(problem.all_rows());
    return twice_energy > 0.0 ? problem.reference() / std::sqrt(rows * twice_energy) : 1.0;
}

bool rows_feel_nothing(const Prepared& problem, Solution& solution) {
    constexpr double rounding = 1e-12;
    if (!problem.is_definite() || !all_of(problem.communicator(), hold_zero(problem.cones()))) return false;
    Solution free;
    free.lambda.assign(problem.b().size(), 0.0);
    problem.free_velocities(free.x);
    const double twice_energy =
        sum_of(problem.communicator(), std::inner_product(free.x.begin(), free.x.end(), problem.a().begin(), 0.0));
    const auto rows = static_cast<double>(problem.all_rows());
    if (!(problem.reference() <= rounding * std::sqrt(rows * std::max(twice_energy, 0.0)))) return false;
    solution = std::move(free);
    return true;
}

bool moves_freely(const Prepared& problem, Solution& solution) {
    if (!problem.is_definite()) return false;
    Solution free;
    free.lambda.assign(solution.lambda.size(), 0.0);
    if (all_of(problem.communicator(), is_at_rest(problem))) {
        free.x.assign(problem.a().size(), 0.0);
        solution = std::move(free);
        return true;
    }
    problem.free_velocities(free.x);
    const Errors error = problem.measure(free.x, free.lambda);
    constexpr double no_digits = 1e-3;  // of rounding: what is measured has three digits at most
    if (!(error.rounding > no_digits && rows_are_rounding(error))) return false;
    solution = std::move(free);
    return true;
}

}  // namespace delassus
