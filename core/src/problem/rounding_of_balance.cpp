// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "delassus/needs.hpp"

namespace delassus {

RoundingOfBalance PreparedProblem::rounding_of_balance(const Solution& solution) const {
    const Problem& problem = this->problem();
    const auto n = static_cast<std::size_t>(problem.n());
    if (n == 0) return {};
    std::vector<double> magnitude(n), momentum(n, 0.0), impulse(n, 0.0), reactions(n, 0.0);
    for (std::size_t i = 0; i < n; ++i) magnitude[i] = std::abs(problem.a[i]);
    problem.H.multiply_add(1.0, solution.x.data(), momentum.data());
    problem.D.transpose_multiply_add(1.0, solution.lambda.data(), impulse.data());
    SparseMatrix absolute = problem.H;
    std::vector<double> sizes = solution.x;
    const auto make_absolute = [](std::span<double> values) {
        for (double& value : values) value = std::abs(value);
    };
    make_absolute(absolute.value);
    make_absolute(sizes);
    absolute.multiply_add(1.0, sizes.data(), magnitude.data());
    absolute = problem.D;
    sizes = solution.lambda;
    make_absolute(absolute.value);
    make_absolute(sizes);
    absolute.transpose_multiply_add(1.0, sizes.data(), reactions.data());
    for (std::size_t i = 0; i < n; ++i) magnitude[i] += reactions[i];
    const auto norm = [](std::span<const double> values) {
        double sum = 0.0;
        for (const double value : values) sum += value * value;
        return std::sqrt(sum);
    };
    const double divisor = std::max({norm(momentum), norm(impulse), norm(problem.a)});
    if (!(divisor > 0.0)) return {};
    const double unit = 0.5 * std::numeric_limits<double>::epsilon() / divisor;
    return {unit * norm(magnitude), unit * norm(reactions)};
}

}  // namespace delassus
