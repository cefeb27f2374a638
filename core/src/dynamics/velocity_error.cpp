// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/velocity_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace delassus {

// The error of a step in the velocities is, to leading order, ½ h² v̈ for implicit Euler and h³ v‴/12 for the
// trapezoidal rule. With the divided difference of order p + 1 of the velocities at the ends of the last steps t₀ > t₁
// > …, and c = ½ or 1/12,
//
//     e = c |[t₀, …, t_{p+1}] v| Π,      Π = ∏_{k ≥ 1} (t₀ − t_k),
//
// which for steps of one size is c |δ²v| or c |δ³v|. What the last steps show of it is taken for this one; a shorter
// one takes its share h/h̄ of it, with the mean h̄ = (Π/(p + 1)!)^(1/(p+1)) of their sizes, so that the parts of a step
// err together by no more than it would. A longer one is not taken to err by more than the last ones. A single impact
// shows in p + 1 differences of order p + 1, and the steps after it are smooth: so the least of p + 2 counts, which is
// 0 in the first steps.
//
// Solves that leave the errors ε₀, ε₁, … in the last velocities leave Σ w_i ε_i in that difference, with the weights
// w_i = Π / ∏_{k ≠ i} (t_i − t_k): 1, −2, 1 or 1, −3, 3, −1 for steps of one size. They have nothing to do with one
// another, so that their squares add up. If that were taken for the method's error, one solve that ends far above its
// tolerance would loosen the tolerances of the next, and so on.
VelocityError::VelocityError(int order)
    : constant_(order == 1 ? 0.5 : 1.0 / 12.0),
      sizes_(static_cast<std::size_t>(order) + 1),
      differences_(static_cast<std::size_t>(order) + 1),
      jumps_(static_cast<std::size_t>(order) + 2),
      left_(static_cast<std::size_t>(order) + 2) {}

void VelocityError::note(const std::vector<double>& v, std::span<const double> left, double last, double next) {
    const std::size_t n = v.size(), points = sizes_.size() + 1;
    if (differences_[0].empty()) {
        for (auto* list : {&differences_, &jumps_, &left_})
            for (auto& part : *list) part.assign(n, 0.0);
        differences_[0] = v;
        error_.assign(n, 0.0);
        noise_.assign(n, 0.0);
        return;
    }
    for (auto* list : {&jumps_, &left_}) std::rotate(list->begin(), list->end() - 1, list->end());
    std::rotate(sizes_.begin(), sizes_.end() - 1, sizes_.end());
    sizes_[0] = last;
    std::array<double, 4> back{}, squares{};  // t₀ − t_k, w_k²
    for (std::size_t k = 1; k < points; ++k) back[k] = back[k - 1] + (sizes_[k - 1] > 0.0 ? sizes_[k - 1] : last);
    double product = 1.0, factorial = 1.0;
    for (std::size_t k = 1; k < points; ++k) {
        product *= back[k];
        factorial *= static_cast<double>(k);
    }
    for (std::size_t i = 0; i < points; ++i) {
        double weight = product;
        for (std::size_t k = 0; k < points; ++k)
            if (k != i) weight /= back[k] - back[i];
        squares[i] = weight * weight;
    }
    const double mean = std::pow(product / factorial, 1.0 / static_cast<double>(sizes_.size()));
    const double share = constant_ * std::min(1.0, next / mean);
    for (std::size_t i = 0; i < n; ++i) {
        double difference = v[i];
        for (std::size_t k = 0; k < differences_.size(); ++k) {
            const double before = std::exchange(differences_[k][i], difference);
            difference = (difference - before) / back[k + 1];
        }
        jumps_[0][i] = std::abs(difference) * product;
        left_[0][i] = left.empty() ? 0.0 : left[i];
        double least = jumps_[0][i], noise = 0.0;
        for (const auto& jump : jumps_) least = std::min(least, jump[i]);
        for (std::size_t k = 0; k < points; ++k) noise += squares[k] * left_[k][i] * left_[k][i];
        error_[i] = share * least;
        noise_[i] = share * std::sqrt(noise);
    }
}

void VelocityError::forget() {
    for (auto* list : {&differences_, &jumps_, &left_})
        for (auto& part : *list) part.clear();
    for (auto* part : {&error_, &noise_}) part->clear();
    std::ranges::fill(sizes_, 0.0);
}

std::vector<std::vector<double>> VelocityError::save() const {
    std::vector<std::vector<double>> memory = differences_;
    memory.insert(memory.end(), jumps_.begin(), jumps_.end() - 1);
    memory.insert(memory.end(), left_.begin(), left_.end());
    return memory;
}

void VelocityError::load(std::span<std::vector<double>> memory, std::span<const double> sizes) {
    forget();
    std::ranges::copy(sizes, sizes_.begin());
    const std::size_t n = memory[0].size();
    if (n == 0) return;
    auto next = memory.begin();
    for (auto& part : differences_) part = std::move(*next++);
    for (std::size_t k = 0; k + 1 < jumps_.size(); ++k) jumps_[k] = std::move(*next++);
    for (auto& part : left_) part = std::move(*next++);
    jumps_.back().assign(n, 0.0);
    error_.assign(n, 0.0);
    noise_.assign(n, 0.0);
}

}  // namespace delassus
