// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/step_retries.hpp"

#include <algorithm>

namespace delassus {

StepRetries::~StepRetries() {
    if (!first_) return;
    system_.expect_nothing();
    solver_.solve_to(1.0);
}

void StepRetries::prepare(const StepTooDeep& failure, std::span<const ContactPoint> contacts, const State& end) {
    if (!first_) first_ = failure;
    if (!expect(failure, contacts, end) && !solve_closer(failure)) throw StepTooDeep(*first_);
}

void StepRetries::give_up() const {
    if (first_) throw StepTooDeep(*first_);
}

bool StepRetries::expect(const StepTooDeep& failure, std::span<const ContactPoint> contacts, const State& end) {
    constexpr std::size_t most = 8;
    const auto is_of_pair = [&](const ContactPoint& contact) {
        const auto bodies = system_.contact_bodies(contact);
        return std::pair<BodyIndex, BodyIndex>(std::minmax(bodies[0], bodies[1])) == failure.bodies();
    };
    if (!expects_ || expected_.size() == most || std::any_of(contacts.begin(), contacts.end(), is_of_pair))
        return false;
    if (!expected_.insert(failure.bodies()).second) return false;
    system_.expect_end(end);
    return true;
}

bool StepRetries::solve_closer(const StepTooDeep& failure) {
    constexpr double each = 0.1, least = 1e-3, better = 0.5;
    if (share_ < 1.0 && failure.depth() > better * failure.last_depth()) return false;
    if (share_ <= least) return false;
    solver_.solve_to(share_ *= each);
    return true;
}

}  // namespace delassus
