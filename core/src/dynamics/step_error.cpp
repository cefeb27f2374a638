// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step_error.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/memory.hpp"

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

void StepError::save(std::vector<double>& memory) const {
    memory.push_back(before_.empty() ? 0.0 : 1.0);
    for (const auto* part : {&before_, &change_, &jumps_[0], &jumps_[1]})
        memory.insert(memory.end(), part->begin(), part->end());
}

void StepError::load(std::span<const double>& rest, std::size_t n) {
    forget();
    const auto take = [&rest](std::size_t count) { return take_from(rest, count, "the last steps' velocities"); };
    if (take(1)[0] == 0.0) return;
    for (auto* part : {&before_, &change_, &jumps_[0], &jumps_[1]}) {
        const auto values = take(n);
        part->assign(values.begin(), values.end());
    }
    jumps_[2].assign(n, 0.0);
    error_.assign(n, 0.0);
}

}  // namespace delassus
