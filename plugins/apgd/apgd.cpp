// SPDX-License-Identifier: BSD-3-Clause
#include "apgd.hpp"

#include <algorithm>
#include <cmath>

namespace delassus::apgd {

namespace {

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
    for (sdk::Vector* v : {&velocity_, &next_, &next_velocity_, &change_, &product_}) v->setZero(problem.m);
    iterate(run);
    return run.finish(x, lambda);
}

// û is affine in λ̂, so that û of the extrapolated point is the extrapolation of û: one product with N̂ an iteration.
void AcceleratedGradient::iterate(sdk::ScaledRun& run) {
    scaled_.gradient(lambda_, velocity_);
    if (run.check(lambda_, velocity_)) return;
    point_ = lambda_;
    point_velocity_ = velocity_;
    step_ = 1.0;
    double theta = 1.0;
    while (true) {
        if (gradient_step(run)) return;
        next_velocity_ = point_velocity_ + product_;
        if (run.check(next_, next_velocity_)) return;

        // Restart where the gradient mapping (y − λ⁺)/t points against the motion (O'Donoghue and Candès 2015, eq. 13).
        const bool restart = restart_ && change_.dot(next_ - lambda_) < 0.0;
        const double next_theta = restart ? 1.0 : 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * theta * theta));
        const double momentum = restart ? 0.0 : (theta - 1.0) / next_theta;
        theta = next_theta;
        if (run.stale() || run.iteration() % refresh_interval == 0) {
            scaled_.gradient(next_, next_velocity_);
            scaled_.gradient(lambda_, velocity_);
        }
        point_ = next_ + momentum * (next_ - lambda_);
        point_velocity_ = next_velocity_ + momentum * (next_velocity_ - velocity_);
        lambda_.swap(next_);
        velocity_.swap(next_velocity_);
        step_ = std::min(growth_ * step_, longest_step);
    }
}

// next = Π(y − t û(y)) with the largest t that backtracking allows: f(next) must not exceed the quadratic model
// f(y) + û(y)ᵀd + ‖d‖²/(2t). f is ½ λ̂ᵀN̂λ̂ + r̂ᵀλ̂ as a whole, so f(next) − f(y) − û(y)ᵀd = ½ dᵀN̂d exactly, and the test is
// t dᵀN̂d ≤ ‖d‖²: no difference of two values of f, hence no stall by cancellation. True: stop.
bool AcceleratedGradient::gradient_step(sdk::ScaledRun& run) {
    while (true) {
        next_ = point_ - step_ * point_velocity_;
        scaled_.project(next_);
        change_ = next_ - point_;
        scaled_.multiply(change_, product_);
        const double square = change_.squaredNorm();
        const double curvature = change_.dot(product_);
        if (!(step_ * curvature > square)) return false;
        if (run.count()) return true;
        step_ = std::min(shrinkage_ * step_, square / curvature);
    }
}

}  // namespace delassus::apgd
