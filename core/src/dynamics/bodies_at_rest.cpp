// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/bodies_at_rest.hpp"

#include <algorithm>

#include "dynamics/velocity_contacts.hpp"

namespace delassus {

// Norms take the diagonal of H: what couples the velocities of one body changes them by a factor near 1.
void BodiesAtRest::begin(const Problem& problem, std::span<const std::int32_t> bodies) {
    body_ = problem.m() > 0 ? bodies : std::span<const std::int32_t>{};
    if (body_.empty()) return;
    diagonal_of(problem.H, mass_);
    free_.assign(static_cast<std::size_t>(*std::ranges::max_element(body_)) + 1, 0.0);
    for (std::size_t i = 0; i < body_.size(); ++i)
        free_[static_cast<std::size_t>(body_[i])] += problem.a[i] * problem.a[i] / mass_[i];
}

bool BodiesAtRest::stands(std::size_t body, double now, double error) const {
    constexpr double many = 20.0, largest_error = 1e-8;
    const double share = many * std::min(error, largest_error);
    return now <= share * share * free_[body];
}

bool BodiesAtRest::all_stand(std::span<const std::int32_t> columns, std::span<const double> x, double error) const {
    if (body_.empty()) return false;
    thread_local std::vector<double> now;  // 0 between calls: islands are many, and so are bodies
    if (now.size() < free_.size()) now.resize(free_.size(), 0.0);
    const auto column = [&](std::size_t i) { return columns.empty() ? i : static_cast<std::size_t>(columns[i]); };
    const auto body = [&](std::size_t i) { return static_cast<std::size_t>(body_[column(i)]); };
    for (std::size_t i = 0; i < x.size(); ++i) now[body(i)] += mass_[column(i)] * x[i] * x[i];
    bool all = true;
    for (std::size_t i = 0; i < x.size(); ++i) all = all && stands(body(i), now[body(i)], error);
    for (std::size_t i = 0; i < x.size(); ++i) now[body(i)] = 0.0;
    return all;
}

void BodiesAtRest::stop(std::span<const double> left, std::span<double> x) {
    now_.assign(free_.size(), 0.0);
    error_.assign(free_.size(), 0.0);
    for (std::size_t i = 0; i < body_.size(); ++i) {
        const auto body = static_cast<std::size_t>(body_[i]);
        now_[body] += mass_[i] * x[i] * x[i];
        error_[body] = std::max(error_[body], left[i]);
    }
    for (std::size_t i = 0; i < body_.size(); ++i) {
        const auto body = static_cast<std::size_t>(body_[i]);
        if (stands(body, now_[body], error_[body])) x[i] = 0.0;
    }
}

}  // namespace delassus
