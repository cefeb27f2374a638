// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/contact_gain.hpp"

#include <algorithm>
#include <numeric>

#include "dynamics/velocity_contacts.hpp"

namespace delassus {

ContactWork contact_work(double work, const DynamicalSystem& system, const State& at, const std::vector<double>& begin,
                         const std::vector<double>& end, const Problem& problem) {
    if (work == 0.0) return {};
    std::vector<double> momentum;
    const auto kinetic = [&](const std::vector<double>& velocities) {
        momentum.assign(velocities.size(), 0.0);
        system.multiply_mass(at, 1.0, velocities.data(), momentum.data());
        return 0.5 * std::inner_product(velocities.begin(), velocities.end(), momentum.begin(), 0.0);
    };
    constexpr double resting = 1e-4;
    std::vector<double> diagonal;
    diagonal_of(problem.H, diagonal);
    double of_forces = 0.0;
    for (std::size_t i = 0; i < diagonal.size(); ++i) of_forces += 0.5 * problem.a[i] * problem.a[i] / diagonal[i];
    return {work, std::max({kinetic(begin), kinetic(end), resting * of_forces})};
}

}  // namespace delassus
