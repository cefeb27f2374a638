// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/contact_gain.hpp"

#include <algorithm>
#include <numeric>

namespace delassus {

ContactWork contact_work(double work, const DynamicalSystem& system, const State& at, const std::vector<double>& begin,
                         const std::vector<double>& end) {
    std::vector<double> momentum;
    const auto kinetic = [&](const std::vector<double>& velocities) {
        momentum.assign(velocities.size(), 0.0);
        system.multiply_mass(at, 1.0, velocities.data(), momentum.data());
        return 0.5 * std::inner_product(velocities.begin(), velocities.end(), momentum.begin(), 0.0);
    };
    return {work, std::max(kinetic(begin), kinetic(end))};
}

}  // namespace delassus
