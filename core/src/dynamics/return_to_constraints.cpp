// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/return_to_constraints.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace delassus {
namespace {

constexpr int most_iterations = 10;
constexpr double epsilon = std::numeric_limits<double>::epsilon();

double largest(const std::vector<double>& values) {
    double most = 0.0;
    for (const double value : values) most = std::max(most, std::abs(value));
    return most;
}

/// Calls move() until what measure() returns is rounding: below `rounding`, or below `small` and no longer falling.
template <class Measure, class Move>
void lower(double rounding, double small, std::string_view method, const State& begin, double h, Measure measure,
           Move move) {
    double last = std::numeric_limits<double>::infinity();
    for (int i = 0;; ++i) {
        const double off = measure();
        if (off <= rounding || (off <= small && off > 0.25 * last)) return;
        if (!(off < last) || i == most_iterations)
            throw StepTooLong(fmt::format(
                "{} cannot take the step from t = {:.9g} with h = {:.9g}: its end is too far from where the "
                "constraints hold (off by {:.3g}); take shorter steps",
                method, begin.t, h, off));
        last = off;
        move();
    }
}

}  // namespace

void return_positions(const DynamicalSystem& system, std::string_view method, const State& begin, State& end, double h,
                      const LeastChange& least) {
    std::vector<double> off(static_cast<std::size_t>(system.m()));
    const double size = 1.0 + largest(end.q);
    lower(
        16.0 * epsilon * size, 1e-10 * size, method, begin, h,
        [&] {
            system.constraint(end, off.data());
            return largest(off);
        },
        [&] { system.increment(end.q.data(), least(off).data(), end.q.data()); });
}

void return_velocities(const DynamicalSystem& system, std::string_view method, const State& begin, State& end, double h,
                       const SparseMatrix& D, const LeastChange& least) {
    std::vector<double> off(static_cast<std::size_t>(system.m()));
    const double size = 1.0 + largest(end.v);
    lower(
        16.0 * epsilon * size, 1e-8 * size, method, begin, h,
        [&] {
            system.constraint_rate(end, off.data());
            D.multiply_add(1.0, end.v.data(), off.data());
            return largest(off);
        },
        [&] {
            const Vector& x = least(off);
            for (std::size_t i = 0; i < end.v.size(); ++i) end.v[i] += x[static_cast<Eigen::Index>(i)];
        });
}

}  // namespace delassus
