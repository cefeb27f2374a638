// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step_error.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace delassus {

// The error of a step of implicit Euler in the velocities, ½ h² v̈, is about half of the second difference of the
// velocities: what the last steps show of it is taken for this one. A single impact shows in two differences, and the
// steps after it are smooth: so the least of three counts, which is 0 in the first steps.
//
// Solves that leave the errors ε₀, ε₁, ε₂ in the last three velocities leave ½(ε₀ − 2 ε₁ + ε₂) in that half difference.
// They have nothing to do with one another, so that their squares add up: ¼(|ε₀|² + 4 |ε₁|² + |ε₂|²). If that were
// taken for the method's error, one solve that ends far above its tolerance would loosen the tolerances of the next,
// and so on.
void StepError::note(const std::vector<double>& v, std::span<const double> left) {
    const std::size_t n = v.size();
    const auto all = {&change_, &jumps_[0], &jumps_[1], &jumps_[2], &left_[0], &left_[1], &left_[2], &error_, &noise_};
    if (before_.empty()) {
        before_ = v;
        for (auto* part : all) part->assign(n, 0.0);
        return;
    }
    for (auto* last : {&jumps_, &left_}) {
        (*last)[2].swap((*last)[1]);
        (*last)[1].swap((*last)[0]);
    }
    for (std::size_t i = 0; i < n; ++i) {
        const double change = v[i] - before_[i];
        jumps_[0][i] = 0.5 * std::abs(change - change_[i]);
        change_[i] = change;
        error_[i] = std::min({jumps_[0][i], jumps_[1][i], jumps_[2][i]});
        left_[0][i] = left.empty() ? 0.0 : left[i];
        noise_[i] = 0.5 * std::hypot(left_[0][i], 2.0 * left_[1][i], left_[2][i]);
    }
    before_ = v;
}

void StepError::forget() {
    for (auto* part :
         {&before_, &change_, &jumps_[0], &jumps_[1], &jumps_[2], &left_[0], &left_[1], &left_[2], &error_, &noise_})
        part->clear();
}

std::array<std::vector<double>, StepError::kept> StepError::save() const {
    return {before_, change_, jumps_[0], jumps_[1], left_[0], left_[1], left_[2]};
}

void StepError::load(std::array<std::vector<double>, kept> memory) {
    forget();
    const std::size_t n = memory[0].size();
    if (n == 0) return;
    before_ = std::move(memory[0]);
    change_ = std::move(memory[1]);
    jumps_[0] = std::move(memory[2]);
    jumps_[1] = std::move(memory[3]);
    for (std::size_t k = 0; k < 3; ++k) left_[k] = std::move(memory[4 + k]);
    jumps_[2].assign(n, 0.0);
    error_.assign(n, 0.0);
    noise_.assign(n, 0.0);
}

}  // namespace delassus
