// SPDX-License-Identifier: BSD-3-Clause
#include "partitioned/part_proof.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "partitioned/local_entries.hpp"

namespace delassus {

namespace {

double squared(double value) {
    return value * value;
}

/// ‖diag(units) v‖², own entries.
double squared_norm(const std::vector<double>& v, const std::vector<double>& units) {
    double sum = 0.0;
    for (std::size_t i = 0; i < v.size(); ++i) sum += squared(units[i] * v[i]);
    return sum;
}

}  // namespace

PartProof::PartProof(const PreparedPart::Implementation& part) : part_(part) {
    find_units();
}

std::vector<double> PartProof::apply_D(const Values& x) const {
    Values local = x, result(static_cast<std::size_t>(part_.problem.m()), 0.0);
    part_.columns.fetch(*part_.communicator, local);
    for (std::size_t row = 0; row < result.size(); ++row)
        for_entries(part_.problem.D, static_cast<std::int64_t>(row),
                    [&](std::int64_t j, double value) { result[row] += value * local[part_.columns.place(j)]; });
    return result;
}

std::vector<double> PartProof::apply_E(const Values& lambda) const {
    Values result(lambda.size(), 0.0);
    if (!part_.compliant) return result;
    Values local = lambda;
    part_.rows.fetch(*part_.communicator, local);
    for (std::size_t row = 0; row < result.size(); ++row)
        for_entries(part_.problem.E, static_cast<std::int64_t>(row),
                    [&](std::int64_t j, double value) { result[row] += value * local[part_.rows.place(j)]; });
    return result;
}

std::vector<double> PartProof::apply_H(const Values& x) const {
    Values local = x, result(x.size(), 0.0);
    part_.columns.fetch(*part_.communicator, local);
    for (std::size_t row = 0; row < result.size(); ++row)
        for_entries(part_.problem.H, static_cast<std::int64_t>(row),
                    [&](std::int64_t j, double value) { result[row] += value * local[part_.columns.place(j)]; });
    return result;
}

std::vector<double> PartProof::apply_transpose(const Values& lambda) const {
    Values local(part_.columns.size(), 0.0);
    for (std::size_t row = 0; row < lambda.size(); ++row)
        for_entries(part_.problem.D, static_cast<std::int64_t>(row),
                    [&](std::int64_t j, double value) { local[part_.columns.place(j)] += value * lambda[row]; });
    part_.columns.add(*part_.communicator, local);
    local.resize(static_cast<std::size_t>(part_.problem.n()));
    return local;
}

// R² stands in for H⁻¹, as for a whole problem.
void PartProof::find_units() {
    const auto& problem = part_.problem;
    R_ = part_.magnitude_of_diagonal();
    for (double& value : R_) value = 1.0 / std::sqrt(value);
    Values local = R_, v(R_.size()), diagonal(static_cast<std::size_t>(problem.m()), 0.0);
    part_.columns.fetch(*part_.communicator, local);
    const std::int64_t first = problem.row_start[static_cast<std::size_t>(part_.communicator->rank())];
    for (std::size_t row = 0; row < diagonal.size(); ++row) {
        const auto number = static_cast<std::int64_t>(row);
        for_entries(problem.D, number, [&](std::int64_t j, double value) {
            diagonal[row] += squared(value * local[part_.columns.place(j)]);
        });
        if (part_.compliant)
            for_entries(problem.E, number, [&](std::int64_t j, double value) {
                if (j == first + number) diagonal[row] += value;
            });
    }
    const Values scaling = part_.cone_scaling(diagonal);
    S_.resize(diagonal.size());
    for (std::size_t c = 0; c < scaling.size(); ++c)
        std::fill_n(S_.begin() + part_.cones[c].first_row, part_.cones[c].rows, scaling[c]);
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = R_[i] * R_[i] * problem.a[i];
    Values r = apply_D(v);
    for (std::size_t row = 0; row < r.size(); ++row) r[row] += problem.b[row];
    Values sum = {squared_norm(r, S_)};
    part_.communicator->sum(sum);
    if (sum[0] > 0.0) size_ = std::sqrt(sum[0]);
}

/// gain / cost, or 0 if the gain ⟨data, direction⟩ is only rounding. squared_cost: of the own entries.
double PartProof::bound(const Values& data, const Values& direction, double squared_cost, const Values& units) const {
    constexpr double epsilon = std::numeric_limits<double>::epsilon();
    Values sums = {0.0, 0.0, squared_cost, 0.0};
    for (std::size_t i = 0; i < data.size(); ++i) {
        sums[0] += data[i] * direction[i];
        sums[1] += std::abs(data[i] * direction[i]);
        sums[3] += squared(direction[i] / units[i]);
    }
    part_.communicator->sum(sums);
    if (!(sums[0] > 64.0 * epsilon * sums[1])) return 0.0;
    return sums[0] / (std::sqrt(sums[2]) + epsilon * std::sqrt(sums[3]));
}

// problem/infeasibility.cpp has both derivations.
double PartProof::by_reactions(const Values& direction) const {
    Values opposite = direction;
    for (double& value : opposite) value = -value;
    Values minus_d = opposite;
    for (const delassus_cone& cone : part_.cones) {
        const auto first = static_cast<std::size_t>(cone.first_row);
        sdk::operations_of(cone).project_dual(cone, opposite.data() + first);
        const bool normal_only = part_.problem.law == Law::Coulomb && sdk::operations_of(cone).has_law();
        for (std::size_t i = 0; i < static_cast<std::size_t>(cone.rows); ++i)
            minus_d[first + i] = normal_only && i > 0 ? 0.0 : minus_d[first + i] - opposite[first + i];
    }
    const double cost = squared_norm(apply_E(minus_d), S_) + squared_norm(apply_transpose(minus_d), R_);
    return bound(part_.problem.b, minus_d, cost, S_);
}

double PartProof::by_velocities(const Values& y) const {
    Values outside = apply_D(y), inside = outside;
    for (const delassus_cone& cone : part_.cones) {
        if (!sdk::operations_of(cone).is_cone) continue;
        const auto first = static_cast<std::size_t>(cone.first_row);
        sdk::operations_of(cone).project_dual(cone, inside.data() + first);
        for (std::size_t i = first; i < first + static_cast<std::size_t>(cone.rows); ++i) outside[i] -= inside[i];
    }
    return bound(part_.problem.a, y, squared_norm(apply_H(y), R_) + squared_norm(outside, S_), R_);
}

double PartProof::size(const Values& x, const Values& lambda) const {
    const auto& problem = part_.problem;
    Values residual = apply_D(x), momentum = apply_transpose(lambda);
    const Values yield = apply_E(lambda), product = apply_H(x);
    for (std::size_t i = 0; i < residual.size(); ++i)
        residual[i] = -squared(S_[i]) * (residual[i] + yield[i] + problem.b[i]);
    for (std::size_t i = 0; i < momentum.size(); ++i) momentum[i] += problem.a[i] - product[i];
    return std::max({by_reactions(lambda), by_reactions(residual), by_velocities(x), by_velocities(momentum)}) / size_;
}

}  // namespace delassus
