// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/velocity_error.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace delassus {

// The error of a step in the velocities is, to leading order, ½ h² v̈ for implicit Euler and h³ v‴/12 for the
// trapezoidal rule. That is ½ of their second difference, or 1/12 of their third: what the last steps show of it is
// taken for this one. A single impact shows in p + 1 differences of order p + 1, and the steps after it are smooth: so
// the least of p + 2 counts, which is 0 in the first steps.
//
// Solves that leave the errors ε₀, ε₁, … in the last velocities leave Σ c_i ε_i in that difference, with the
// coefficients c_i = ±1, ∓2, ±1 or ±1, ∓3, ±3, ∓1. They have nothing to do with one another, so that their squares add
// up. If that were taken for the method's error, one solve that ends far above its tolerance would loosen the
// tolerances of the next, and so on.
VelocityError::VelocityError(int order)
    : constant_(order == 1 ? 0.5 : 1.0 / 12.0),
      coefficients_(order == 1 ? std::vector{1.0, 4.0, 1.0} : std::vector{1.0, 9.0, 9.0, 1.0}),
      differences_(static_cast<std::size_t>(order)),
      jumps_(static_cast<std::size_t>(order) + 2),
      left_(static_cast<std::size_t>(order) + 2) {}

void VelocityError::note(const std::vector<double>& v, std::span<const double> left) {
    const std::size_t n = v.size();
    if (before_.empty()) {
        before_ = v;
        for (auto* list : {&differences_, &jumps_, &left_})
            for (auto& part : *list) part.assign(n, 0.0);
        error_.assign(n, 0.0);
        noise_.assign(n, 0.0);
        return;
    }
    for (auto* list : {&jumps_, &left_}) std::rotate(list->begin(), list->end() - 1, list->end());
    for (std::size_t i = 0; i < n; ++i) {
        double difference = v[i] - before_[i];
        for (auto& last : differences_) difference -= std::exchange(last[i], difference);
        jumps_[0][i] = constant_ * std::abs(difference);
        left_[0][i] = left.empty() ? 0.0 : left[i];
        double least = jumps_[0][i], squares = 0.0;
        for (const auto& jump : jumps_) least = std::min(least, jump[i]);
        for (std::size_t k = 0; k < coefficients_.size(); ++k) squares += coefficients_[k] * left_[k][i] * left_[k][i];
        error_[i] = least;
        noise_[i] = constant_ * std::sqrt(squares);
    }
    before_ = v;
}

void VelocityError::forget() {
    for (auto* list : {&differences_, &jumps_, &left_})
        for (auto& part : *list) part.clear();
    for (auto* part : {&before_, &error_, &noise_}) part->clear();
}

std::vector<std::vector<double>> VelocityError::save() const {
    std::vector<std::vector<double>> memory = {before_};
    memory.insert(memory.end(), differences_.begin(), differences_.end());
    memory.insert(memory.end(), jumps_.begin(), jumps_.end() - 1);
    memory.insert(memory.end(), left_.begin(), left_.end());
    return memory;
}

void VelocityError::load(std::span<std::vector<double>> memory) {
    forget();
    const std::size_t n = memory[0].size();
    if (n == 0) return;
    auto next = memory.begin();
    before_ = std::move(*next++);
    for (auto& part : differences_) part = std::move(*next++);
    for (std::size_t k = 0; k + 1 < jumps_.size(); ++k) jumps_[k] = std::move(*next++);
    for (auto& part : left_) part = std::move(*next++);
    jumps_.back().assign(n, 0.0);
    error_.assign(n, 0.0);
    noise_.assign(n, 0.0);
}

}  // namespace delassus
