// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step_error.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace delassus {

// The error of a step of implicit Euler in the velocities, ½ h² v̈, is about half of the second difference of the
// velocities: what the last steps show of it is taken for this one. A single impact shows in two differences, and the
// steps after it are smooth: so the least of three counts, which is 0 in the first steps.
void StepError::note(const std::vector<double>& v) {
    const std::size_t n = v.size();
    if (before_.empty()) {
        before_ = v;
        for (auto* part : {&change_, &jumps_[0], &jumps_[1], &jumps_[2], &error_}) part->assign(n, 0.0);
        return;
    }
    jumps_[2].swap(jumps_[1]);
    jumps_[1].swap(jumps_[0]);
    for (std::size_t i = 0; i < n; ++i) {
        const double change = v[i] - before_[i];
        jumps_[0][i] = 0.5 * std::abs(change - change_[i]);
        change_[i] = change;
        error_[i] = std::min({jumps_[0][i], jumps_[1][i], jumps_[2][i]});
    }
    before_ = v;
}

void StepError::forget() {
    for (auto* part : {&before_, &change_, &jumps_[0], &jumps_[1], &jumps_[2], &error_}) part->clear();
}

std::array<std::vector<double>, StepError::kept> StepError::save() const {
    return {before_, change_, jumps_[0], jumps_[1]};
}

void StepError::load(std::array<std::vector<double>, kept> memory) {
    forget();
    const std::size_t n = memory[0].size();
    if (n == 0) return;
    before_ = std::move(memory[0]);
    change_ = std::move(memory[1]);
    jumps_[0] = std::move(memory[2]);
    jumps_[1] = std::move(memory[3]);
    jumps_[2].assign(n, 0.0);
    error_.assign(n, 0.0);
}

}  // namespace delassus
