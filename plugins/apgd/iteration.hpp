// SPDX-License-Identifier: BSD-3-Clause
// Nesterov's accelerated projected gradient method with backtracking, step growth and adaptive restart (README.md): the
// iteration, for one process and for the processes of a problem in parts (plugins/apgd_petsc).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "delassus/sdk/scaled_run.hpp"

namespace delassus::apgd {

inline constexpr delassus_option options[] = {
    sdk::real_option("step_growth", "1.02", 1.0, 2.0, "", "factor by which the step grows after each iteration"),
    sdk::real_option("step_shrinkage", "0.9", 0.1, 0.999, "", "largest factor by which backtracking cuts the step"),
    sdk::boolean_option("restart", true, "drop the momentum where it points uphill"),
    sdk::integer_option("stall_iterations", "100000", 0, 1e9, "iterations",
                        "give up after this many iterations without an improvement by 1 %; 0: never"),
};

/// Scaled: an sdk::ScaledProblem, or what has its operations for the rows of one process.
template <class Scaled>
class Iteration {
public:
    explicit Iteration(const sdk::OptionValues& values)
        : growth_(values.real("step_growth")),
          shrinkage_(values.real("step_shrinkage")),
          restart_(values.boolean("restart")),
          stall_iterations_(values.integer("stall_iterations")) {}

    /// Leaves the best iterate in x (n) and lambda (m), where the start is. scaled must be loaded with problem.
    [[nodiscard]] sdk::Outcome solve(const typename Scaled::View& problem, const Scaled& scaled,
                                     const sdk::Request& request, const sdk::Team& team, sdk::MutableVectorView x,
                                     sdk::MutableVectorView lambda) {
        Run run(problem, scaled, request, stall_iterations_);
        if (request.resume()) {
            run.go_on(lambda, best_error_);
            iterate(scaled, run, team, !backtracking_);
        } else {
            lambda_ = run.start(lambda);
            for (sdk::Vector* v : {&velocity_, &next_, &next_velocity_, &point_, &point_velocity_, &change_, &product_})
                v->setZero(problem.m);
            if (!start(scaled, run)) iterate(scaled, run, team, false);
        }
        best_error_ = run.best_residual();
        return run.finish(x, lambda);
    }

private:
    using Run = sdk::ScaledRunOf<Scaled>;
    using Part = typename Scaled::Part;

    static constexpr double longest_step = 1e10;           // N̂ has unit diagonal on the average
    static constexpr std::int64_t refresh_interval = 200;  // iterations between products that renew û
    static constexpr double rounding = 1e-10;              // of sums over all rows, generously

    // True: stop.
    [[nodiscard]] bool start(const Scaled& scaled, Run& run) {
        scaled.gradient(lambda_, velocity_);
        if (run.check(lambda_, velocity_)) return true;
        next_ = lambda_;
        next_velocity_ = velocity_;
        step_ = theta_ = 1.0;
        momentum_ = 0.0;
        since_refresh_ = 0;
        backtracking_ = false;
        return false;
    }

    // û is affine in λ̂, so that û of the extrapolated point is the extrapolation of û: one product with N̂ an iteration.
    // judged: the next iterate was judged by the run that stopped.
    void iterate(const Scaled& scaled, Run& run, const sdk::Team& team, bool judged) {
        for (;; judged = false) {
            if (!judged && (gradient_step(scaled, run, team) || run.judge(natural_))) return;

            // Restart where the gradient mapping (y − λ⁺)/t points against the motion (O'Donoghue and Candès 2015,
            // eq. 13).
            const bool restart = restart_ && uphill_ < 0.0;
            const double next_theta = restart ? 1.0 : 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * theta_ * theta_));
            momentum_ = restart ? 0.0 : (theta_ - 1.0) / next_theta;
            theta_ = next_theta;
            if (run.stale() || ++since_refresh_ >= refresh_interval) {
                since_refresh_ = 0;
                scaled.gradient(next_, next_velocity_);
                scaled.gradient(lambda_, velocity_);
            }
            lambda_.swap(next_);
            velocity_.swap(next_velocity_);
            step_ = std::min(growth_ * step_, longest_step);
        }
    }

    // next = Π(y − t û(y)) with the largest t that backtracking allows: f(next) must not exceed the quadratic model
    // f(y) + û(y)ᵀd + ‖d‖²/(2t). f is ½ λ̂ᵀN̂λ̂ + r̂ᵀλ̂ as a whole, so f(next) − f(y) − û(y)ᵀd = ½ dᵀN̂d exactly, and the
    // test is t dᵀN̂d ≤ ‖d‖². It subtracts no values of f, so cancellation cannot stall it. A step that backtracking has
    // set to ‖d‖²/dᵀN̂d may meet it as an equation; rounding, which differs between numbers of processes, must not cut
    // it again. The quantities that judge next are computed on the way, while its rows are in the cache, and added up
    // together: one reduction an iteration. True: stop. On entry next and its û are the iterate before λ̂, from which
    // the first pass extrapolates to y.
    bool gradient_step(const Scaled& scaled, Run& run, const sdk::Team& team) {
        for (bool first = !std::exchange(backtracking_, false);; first = false) {
            const auto step_and_project = [&](const Part& part) {
                if (first) {
                    part.of(point_) = part.of(lambda_) + momentum_ * (part.of(lambda_) - part.of(next_));
                    part.of(point_velocity_) =
                        part.of(velocity_) + momentum_ * (part.of(velocity_) - part.of(next_velocity_));
                }
                part.of(next_) = part.of(point_) - step_ * part.of(point_velocity_);
                scaled.project(part, next_);
                part.of(change_) = part.of(next_) - part.of(point_);
                return std::array{part.of(change_).squaredNorm()};
            };
            const auto judge = [&](const Part& part) {
                scaled.finish_product(part, product_);
                part.of(next_velocity_) = part.of(point_velocity_) + part.of(product_);
                part.of(run.unscaled()) = part.of(next_).cwiseProduct(part.of(scaled.scaling()));
                return std::array{part.of(change_).dot(part.of(product_)),
                                  part.of(change_).dot(part.of(next_) - part.of(lambda_)),
                                  scaled.natural_square(part, next_, next_velocity_)};
            };
            const auto [square, curvature, uphill, natural] =
                scaled.template sums_about_product<1, 3>(team, change_, step_and_project, judge);
            natural_ = scaled.natural_from(natural);
            uphill_ = uphill;
            if (!(step_ * curvature > (1.0 + rounding) * square)) return false;
            scaled.for_parts(team, [&](const Part& part) {
                part.of(run.unscaled()) = part.of(lambda_).cwiseProduct(part.of(scaled.scaling()));
            });
            step_ = std::min(shrinkage_ * step_, square / curvature);
            if (run.count()) return backtracking_ = true;
        }
    }

    double growth_, shrinkage_;
    bool restart_;
    std::int64_t stall_iterations_;

    double step_ = 1.0;                    // t
    double theta_ = 1.0, momentum_ = 0.0;  // of Nesterov's sequence
    std::int64_t since_refresh_ = 0;       // iterations since û was renewed
    bool backtracking_ = false;            // whether the run stopped between two trials of a step
    double best_error_ = 0.0;              // of the iterates since the start
    sdk::Vector lambda_, velocity_;        // λ̂ of the latest iterate and its û
    sdk::Vector point_, point_velocity_;   // y, where the gradient is taken, and its û
    sdk::Vector next_, next_velocity_;     // the iterate that follows
    sdk::Vector change_, product_;         // d = next − y and N̂ d
    double natural_ = 0.0, uphill_ = 0.0;  // of next: its natural error, and dᵀ(next − λ̂)
};

}  // namespace delassus::apgd
