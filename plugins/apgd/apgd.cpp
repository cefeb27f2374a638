// SPDX-License-Identifier: BSD-3-Clause
#include "apgd.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace delassus::apgd {

namespace {

using Part = sdk::ScaledProblem::Part;

constexpr double longest_step = 1e10;           // N̂ has unit diagonal on the average
constexpr std::int64_t refresh_interval = 200;  // iterations between products that renew û

}  // namespace

AcceleratedGradient::AcceleratedGradient(const sdk::OptionValues& options)
    : growth_(options.real("step_growth")),
      shrinkage_(options.real("step_shrinkage")),
      restart_(options.boolean("restart")),
      stall_iterations_(options.integer("stall_iterations")) {}

sdk::Outcome AcceleratedGradient::solve(const sdk::ProblemView& problem, const sdk::Request& request,
                                        sdk::MutableVectorView x, sdk::MutableVectorView lambda) {
    scaled_.load(problem);
    sdk::ScaledRun run(problem, scaled_, request, stall_iterations_);
    lambda_ = run.start(lambda);
    for (sdk::Vector* v : {&velocity_, &next_, &next_velocity_, &point_, &point_velocity_, &change_, &product_})
        v->setZero(problem.m);
    iterate(run, sdk::ScaledProblem::useful(team(), problem));
    return run.finish(x, lambda);
}

// û is affine in λ̂, so that û of the extrapolated point is the extrapolation of û: one product with N̂ an iteration.
void AcceleratedGradient::iterate(sdk::ScaledRun& run, const sdk::Team& team) {
    scaled_.gradient(lambda_, velocity_);
    if (run.check(lambda_, velocity_)) return;
    next_ = lambda_;
    next_velocity_ = velocity_;
    step_ = 1.0;
    double theta = 1.0, momentum = 0.0;
    while (true) {
        if (gradient_step(run, team, momentum)) return;
        if (run.judge(natural_)) return;

        // Restart where the gradient mapping (y − λ⁺)/t points against the motion (O'Donoghue and Candès 2015, eq. 13).
        const bool restart = restart_ && uphill_ < 0.0;
        const double next_theta = restart ? 1.0 : 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * theta * theta));
        momentum = restart ? 0.0 : (theta - 1.0) / next_theta;
        theta = next_theta;
        if (run.stale() || run.iteration() % refresh_interval == 0) {
            scaled_.gradient(next_, next_velocity_);
            scaled_.gradient(lambda_, velocity_);
        }
        lambda_.swap(next_);
        velocity_.swap(next_velocity_);
        step_ = std::min(growth_ * step_, longest_step);
    }
}

// next = Π(y − t û(y)) with the largest t that backtracking allows: f(next) must not exceed the quadratic model f(y) +
// û(y)ᵀd + ‖d‖²/(2t). f is ½ λ̂ᵀN̂λ̂ + r̂ᵀλ̂ as a whole, so f(next) − f(y) − û(y)ᵀd = ½ dᵀN̂d exactly, and the test is
// t dᵀN̂d ≤ ‖d‖². It subtracts no values of f, so cancellation cannot stall it. The quantities that judge next are
// computed on the way, while its rows are in the cache. True: stop.
// On entry next and its û are the iterate before λ̂, from which the first pass extrapolates to y.
bool AcceleratedGradient::gradient_step(sdk::ScaledRun& run, const sdk::Team& team, double momentum) {
    for (bool first = true;; first = false) {
        const auto step_and_project = [&](const Part& part) {
            if (first) {
                part.of(point_) = part.of(lambda_) + momentum * (part.of(lambda_) - part.of(next_));
                part.of(point_velocity_) =
                    part.of(velocity_) + momentum * (part.of(velocity_) - part.of(next_velocity_));
            }
            part.of(next_) = part.of(point_) - step_ * part.of(point_velocity_);
            scaled_.project(part, next_);
            part.of(change_) = part.of(next_) - part.of(point_);
            return std::array{part.of(change_).squaredNorm()};
        };
        const auto judge = [&](const Part& part) {
            scaled_.finish_product(part, product_);
            part.of(next_velocity_) = part.of(point_velocity_) + part.of(product_);
            part.of(run.unscaled()) = part.of(next_).cwiseProduct(part.of(scaled_.scaling()));
            return std::array{part.of(change_).dot(part.of(product_)),
                              part.of(change_).dot(part.of(next_) - part.of(lambda_)),
                              scaled_.natural_square(part, next_, next_velocity_)};
        };
        const auto [square, curvature, uphill, natural] =
            scaled_.sums_about_product<1, 3>(team, change_, step_and_project, judge);
        natural_ = scaled_.natural_from(natural);
        uphill_ = uphill;
        if (!(step_ * curvature > square)) return false;
        scaled_.for_parts(team, [&](const Part& part) {
            part.of(run.unscaled()) = part.of(lambda_).cwiseProduct(part.of(scaled_.scaling()));
        });
        if (run.count()) return true;
        step_ = std::min(shrinkage_ * step_, square / curvature);
    }
}

}  // namespace delassus::apgd
