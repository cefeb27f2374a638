// SPDX-License-Identifier: BSD-3-Clause
// Past an end of the path of exact Coulomb: a hop.
//
// At a fixed τ the shift ς of the associated law follows dς/dt = ‖s_t‖ − ς by implicit Euler of step h,
//     û = s − σ e₀,   σ = (1 − φ)ς + φ‖s_t‖,   φ = h/(1 + h),   then ς ← σ.
// This flow comes to rest where the central path of De Saxcé's form lies, and its steps exist where Newton's method
// along that path finds none. Where it lags little, the path is tried again.
#include <algorithm>
#include <cmath>

#include "interior_point.hpp"

namespace delassus::ipm {

namespace {

constexpr int longest_flow = 60;       // Euler steps in one hop
constexpr int most_newton_steps = 12;  // in one of them
constexpr int most_path_steps = 8;     // of Newton's method for φ = 1
constexpr double newton_goal = 0.2;    // in products and equations, relative
constexpr double path_goal = 0.1;
// In units of √(τ contacts). A larger lag is accepted sooner, but it stays in the equations of the path that follows:
// of wall10, 1.8e-3 was left after 900 iterations with 0.3, 1.2e-5 with 0.003.
constexpr double small_lag = 0.003;
constexpr double largest_step = 4.0;  // h
constexpr double fall = 0.7;          // of τ over a hop
constexpr double most_rising = 30.0;  // of τ, where hops come back to the same end

}  // namespace

// Newton's method at fixed τ, ς and φ. True: reached.
bool InteriorPoint::follow_shift(const Judge& judge, double tau, double goal, int most) {
    const double size = std::sqrt(tau * std::max(cones_.degree(), 1.0));
    for (int k = 0;; ++k) {
        find_residuals();
        cones_.scale(theta_);
        const double rest = std::max(cones_.distance_from_centre(tau), system_.norm(f_, g_) / size);
        if (!std::isfinite(rest)) return false;
        if (k > 0 && rest < goal) return true;
        if (k == most || is_stopped_) return false;
        system_.factorize(cones_, theta_);
        cones_.rows_to_basis(g_);
        cones_.target(tau, false, target_);
        find_direction(Equations::tightest_residual);
        if (!move(std::min(1.0, 0.9 * cones_.longest_step()))) return false;
        is_stopped_ = judge();
    }
}

// True: the iterate is on, or near, the path at the hop's τ. Stopped, it goes on where it is called again.
bool InteriorPoint::follow_flow(const Judge& judge, Hop& hop) {
    const double size = std::sqrt(hop.tau * std::max(cones_.degree(), 1.0));
    const auto undo = [&] {
        cones_ = hop.kept;
        x_ = hop.kept_x;
    };
    for (; hop.steps < longest_flow; ++hop.steps) {
        cones_.set_share(hop.h / (1.0 + hop.h));
        const std::int64_t before = system_.factorizations();
        if (!follow_shift(judge, hop.tau, newton_goal, most_newton_steps)) {
            if (is_stopped_) return false;
            undo();
            hop.h *= 0.4;
            if (++hop.failures > 10) break;
            continue;
        }
        const std::int64_t newton_steps = system_.factorizations() - before;
        hop.failures = 0;
        hop.lag = cones_.shift_lag() / size;
        cones_.advance_shift();
        hop.kept = cones_;
        hop.kept_x = x_;
        hop.h = std::min(hop.h * (newton_steps <= 3 ? 1.3 : newton_steps < 6 ? 1.0 : 0.8), largest_step);
        if (hop.lag < 0.5 * hop.tried_at || hop.steps % 8 == 7) {
            hop.tried_at = std::min(hop.lag, hop.tried_at);
            cones_.set_share(1.0);
            if (follow_shift(judge, hop.tau, path_goal, most_path_steps)) return true;
            undo();
        }
        if (hop.lag < small_lag && hop.steps >= 3) return true;
        if (is_stopped_) return false;
    }
    return hop.lag < 1.0;
}

// From the jam of the path on, until it is followed to its end (true) or hops lead no further down.
bool InteriorPoint::hop_on(const Judge& judge) {
    const double tau = cones_.mean_product();
    rise_ = tau < 0.9 * lowest_tau_ ? 1.0 : 2.0 * rise_;
    lowest_tau_ = std::min(lowest_tau_, tau);
    if (rise_ > most_rising || ++hops_ > most_hops_) return false;
    cones_.take_shift_path();
    hop_.emplace(fall * rise_ * tau, cones_, x_);
    return end_hop(judge);
}

// The rest of the hop at hand. False: stopped.
bool InteriorPoint::end_hop(const Judge& judge) {
    if (!follow_flow(judge, *hop_) && is_stopped_) return false;
    hop_.reset();
    cones_.take_product_path();
    jam_ = 0.0;
    centre_next_ = 0;
    idle_iterations_ = 0;
    return !is_stopped_;
}

}  // namespace delassus::ipm
