// SPDX-License-Identifier: BSD-3-Clause
// When the penalty ρ changes, and to what.
//
// Where reactions still move and velocities do not, ρ is too small, and the other way round. With scaled λ̂ and ẑ, which
// share a unit, the ratio of their changes ‖Δλ̂‖/‖Δẑ‖ is the step that would move both alike: the residual balancing of
// Boyd et al. (2011, section 3.4.1) and the spectral penalty of Xu, Figueiredo and Goldstein (2017) in this form. It is
// averaged (geometrically) over a window, and ρ follows where it is off by more than a factor of three, because each
// change costs a factorisation.
//
// On the subspace where no contact changes its state the iteration contracts an eigenvector of N̂ with eigenvalue σ by
// about |1 − ρσ|/(1 + ρσ) for active rows, so that each ρ serves the part of the spectrum around 1/ρ and a sequence of
// them serves all: the shifts of the alternating direction implicit method (Wachspress 1966). So where the error has
// not halved for a while ρ is divided by ten, and the balance takes over from there.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "delassus/sdk/problem_view.hpp"

namespace delassus::admm {

class PenaltyRule {
public:
    void reset(Eigen::Index size) {
        lambda_.resize(size);
        z_.resize(size);
        restart();
        milestone_ = std::numeric_limits<double>::infinity();
        milestone_iteration_ = 0;
    }

    /// Takes an iterate (m each, scaled), the best natural error so far and the penalty in use; the penalty to use.
    /// norm(v): of all rows, those of other processes too.
    template <class Norm>
    [[nodiscard]] double next(const sdk::Vector& lambda, const sdk::Vector& z, double best, std::int64_t iteration,
                              double penalty, const Norm& norm) {
        if (best < 0.5 * milestone_) {
            milestone_ = best;
            milestone_iteration_ = iteration;
        }
        if (has_previous_) {
            const double reactions = norm(lambda - lambda_), velocities = norm(z - z_);
            if (reactions > 0.0 || velocities > 0.0) {
                // One of them may rest, where all contacts stick or all are open.
                const double ratio = reactions / (penalty * velocities);
                sum_ += std::log(std::clamp(ratio, 1.0 / largest_ratio, largest_ratio));
                ++terms_;
            }
        }
        lambda_ = lambda;
        z_ = z;
        has_previous_ = true;
        if (iteration - milestone_iteration_ > patience) {
            milestone_ = best;
            milestone_iteration_ = iteration;
            return shifted(0.1 * penalty, penalty);
        }
        if (terms_ < window) return penalty;
        const double balanced = penalty * std::exp(sum_ / terms_);
        sum_ = 0.0;
        terms_ = 0;
        return balanced > 3.0 * penalty || balanced < penalty / 3.0 ? shifted(balanced, penalty) : penalty;
    }

private:
    static constexpr int window = 10;
    static constexpr std::int64_t patience = 50;
    static constexpr double largest_ratio = 100.0;
    static constexpr double smallest = 1e-6, largest = 1e12;

    void restart() {
        has_previous_ = false;
        sum_ = 0.0;
        terms_ = 0;
    }

    double shifted(double wanted, double penalty) {
        const double result = std::clamp(wanted, smallest, largest);
        if (result != penalty) restart();
        return result;
    }

    sdk::Vector lambda_, z_;  // of the previous iterate
    bool has_previous_ = false;
    double sum_ = 0.0;  // of the logarithms of the ratios
    int terms_ = 0;
    double milestone_ = 0.0;
    std::int64_t milestone_iteration_ = 0;
};

}  // namespace delassus::admm
