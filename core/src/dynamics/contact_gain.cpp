// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/contact_gain.hpp"

#include <algorithm>
#include <numeric>

#include "dynamics/velocity_contacts.hpp"

namespace delassus {

double EnergyOfStep::kinetic(const State& at, const std::vector<double>& velocities) {
    momentum_.assign(velocities.size(), 0.0);
    system_.multiply_mass(at, 1.0, velocities.data(), momentum_.data());
    return 0.5 * std::inner_product(velocities.begin(), velocities.end(), momentum_.begin(), 0.0);
}

ContactWork EnergyOfStep::with(double work, const State& at, const std::vector<double>& begin,
                               const std::vector<double>& end, const Problem& problem) {
    constexpr double resting = 1e-4;
    if (work == 0.0) return {};
    diagonal_of(problem.H, diagonal_);
    double of_forces = 0.0;
    for (std::size_t i = 0; i < diagonal_.size(); ++i) of_forces += 0.5 * problem.a[i] * problem.a[i] / diagonal_[i];
    return {work, std::max({kinetic(at, begin), kinetic(at, end), resting * of_forces})};
}

}  // namespace delassus
