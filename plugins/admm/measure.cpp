// SPDX-License-Identifier: BSD-3-Clause
#include "measure.hpp"

#include <algorithm>

namespace delassus::admm {

sdk::Vector Measure::velocity(const sdk::Vector& lambda, const sdk::Vector& x) const {
    sdk::Vector u = problem_.b;
    if (problem_.n > 0) u.noalias() += problem_.D * x;
    if (problem_.E.nonZeros() > 0) u.noalias() += problem_.E * lambda;
    return u;
}

double Measure::claim(const sdk::Vector& lambda, sdk::Vector& x) const {
    if (scaling_.definite()) {
        x = scaling_.N().velocity(problem_, lambda);
        return natural_.natural(lambda, velocity(lambda, x));
    }
    const sdk::Vector momentum = problem_.H * x;
    const sdk::Vector impulse = problem_.D.transpose() * lambda;
    const double rest = (momentum - impulse - problem_.a).norm();
    const double largest = std::max({momentum.norm(), impulse.norm(), problem_.a.norm()});
    return std::max(natural_.natural(lambda, velocity(lambda, x)), largest > 0.0 ? rest / largest : rest);
}

}  // namespace delassus::admm
