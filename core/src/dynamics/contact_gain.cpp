// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/contact_gain.hpp"

#include <algorithm>

#include "dynamics/velocity_contacts.hpp"

namespace delassus {

ContactWork EnergyOfStep::with(double work, const State& at, const std::vector<double>& begin,
                               const std::vector<double>& end, const Problem& problem) {
    constexpr double resting = 1e-4;
    if (work == 0.0) return {};
    diagonal_of(problem.H, diagonal_);
    double of_forces = 0.0;
    for (std::size_t i = 0; i < diagonal_.size(); ++i) of_forces += 0.5 * problem.a[i] * problem.a[i] / diagonal_[i];
    return {work, std::max({kinetic_energy(system_, at, begin, momentum_), kinetic_energy(system_, at, end, momentum_),
                            resting * of_forces})};
}

}  // namespace delassus
