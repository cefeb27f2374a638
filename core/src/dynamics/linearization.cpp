// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/linearization.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "dynamics/linear_problem.hpp"

namespace delassus {

namespace {

double diagonal_entry(const SparseMatrix& A, std::int32_t row) {
    const auto first = A.column.begin() + A.row_start[static_cast<std::size_t>(row)],
               last = A.column.begin() + A.row_start[static_cast<std::size_t>(row) + 1];
    const auto found = std::lower_bound(first, last, row);
    return found != last && *found == row ? A.value[static_cast<std::size_t>(found - A.column.begin())] : 0.0;
}

}  // namespace

Linearization::Linearization(DynamicalSystem& system, double limit)
    : system_(system), limit_(limit), wanted_(std::isfinite(limit) && system.has_stiffness()) {}

void Linearization::judge(const State& begin, const State& end, double h, std::span<const double> force,
                          std::span<const double> linear, const SparseMatrix& H, std::string_view method,
                          StepSolver& solver, StepReport& report) {
    const auto n = static_cast<std::int32_t>(linear.size());
    M_.begin(n, n);
    system_.add_mass(end, 1.0, M_);
    const SparseMatrix& M = M_.finish();
    double largest = 0.0;
    for (const auto* q : {&begin.q, &end.q})
        for (const double value : *q) largest = std::max(largest, std::abs(value));
    const double digits = 10.0 * std::numeric_limits<double>::epsilon() * largest;
    bool definite = true;  // M
    double difference = 0.0, rounding = 0.0, before = 0.0, after = 0.0, forces = 0.0;
    for (std::int32_t i = 0; i < n; ++i) {
        const double mass = diagonal_entry(M, i);
        if (!(mass > 0.0)) {
            definite = false;
            continue;
        }
        const auto squared = [](double value) { return value * value; };
        const auto k = static_cast<std::size_t>(i);
        difference += squared(force[k] - linear[k]) / mass;
        rounding += squared(digits / h * (diagonal_entry(H, i) - mass)) / mass;
        forces += squared(linear[k]) / mass;
        before += squared(begin.v[k]) * mass;
        after += squared(end.v[k]) * mass;
    }
    const auto share = [&](double value) {
        return value > 0.0 ? value / std::sqrt(std::max({before, after, forces})) : 0.0;
    };
    const auto error_now = [&] { return share(std::sqrt(difference) - std::sqrt(rounding)); };
    if (error_now() > limit_ && system_.m() > 0 && definite && !solver.is_shared()) {
        Problem held;
        held.H = M;
        D_.begin(system_.m(), n);
        system_.add_constraint_jacobian(end, 0, D_);
        held.D = D_.finish();
        held.b.assign(static_cast<std::size_t>(system_.m()), 0.0);
        held.cones = free_cones(system_);
        const auto square = [&](std::span<const double> impulse) {
            held.a.assign(impulse.begin(), impulse.end());
            const Vector change = solve_linear(held, solver, report, "linearisation").x;
            return std::max(change.dot(Eigen::Map<const Vector>(impulse.data(), n)), 0.0);
        };
        std::vector<double> off(force.begin(), force.end());
        for (std::size_t i = 0; i < off.size(); ++i) off[i] -= linear[i];
        difference = square(off);
        forces = square(linear);
    }
    const double error = error_now();
    report.linearization = error;
    report.linearization_rounding = share(std::sqrt(rounding));
    if (error <= limit_) return;
    throw StepTooLong(fmt::format(
        "{} cannot take the step from t = {:.9g} with h = {:.9g}: its linear model is off by forces that are {:.2g} of "
        "the velocities in a step, where linearization_limit is {:.2g}; take shorter steps, a method that iterates "
        "(euler_implicit), or a joint in place of a very stiff part",
        method, begin.t, h, error, limit_));
}

OptionInfo linearization_option() {
    return {.key = "linearization_limit",
            .type = DELASSUS_OPTION_REAL,
            .default_value = "0.1",
            .minimum = 0.0,
            .maximum = HUGE_VAL,
            .doc =
                "a step fails if its linear model of the forces is off by more than this share of the velocities; inf: "
                "not measured"};
}

}  // namespace delassus
