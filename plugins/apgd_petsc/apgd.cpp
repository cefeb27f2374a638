// SPDX-License-Identifier: BSD-3-Clause
#include "apgd.hpp"

#include <cstdio>

namespace delassus::petsc {

namespace {

using Part = ScaledPart::Part;

constexpr double longest_step = 1e10;           // N̂ has unit diagonal on the average
constexpr std::int64_t refresh_interval = 200;  // iterations between products that renew û
constexpr double rounding = 1e-10;              // of sums over all rows, generously

}  // namespace

/// One solve: what sdk::ScaledRun is in one process. All numbers that decide are the same on all processes.
struct PartitionedGradient::Run {
    const sdk::LocalProblemView& problem;
    const ScaledPart& scaled;
    const sdk::Request& request;
    sdk::Monitor monitor;
    sdk::Vector unscaled = sdk::Vector::Zero(problem.m);  // λ of the iterate that is judged
    double latest = 0.0;
    std::int64_t iteration = 0;
    bool stale = false;  // a claim of convergence failed: û has drifted

    /// Judges the iterate whose λ is in unscaled; true: stop. A claim rests on û computed anew.
    bool judge(double residual) {
        stale = false;
        if (residual <= sdk::Monitor::aim * request.tolerance()) {
            residual = scaled.measured(problem, unscaled);
            stale = residual > sdk::Monitor::aim * request.tolerance();
        }
        latest = residual;
        return monitor.check(iteration++, nullptr, unscaled, residual);
    }
    /// Counts a product with N that made no new iterate; true: stop.
    bool count() { return monitor.check(iteration++, nullptr, unscaled, latest); }
};

PartitionedGradient::PartitionedGradient(const sdk::OptionValues& options)
    : growth_(options.real("step_growth")),
      shrinkage_(options.real("step_shrinkage")),
      restart_(options.boolean("restart")),
      stall_iterations_(options.integer("stall_iterations")) {
    ensure_petsc();
}

PartitionedGradient::~PartitionedGradient() {
    const Session session;
    scaled_ = {};
}

void PartitionedGradient::analyze(const sdk::LocalProblemView& problem) {
    const Session session;
    scaled_ = {};
    scaled_.analyze(Processes(*problem.raw), problem);
}

void PartitionedGradient::factorize(const sdk::LocalProblemView& problem) {
    const Session session;
    ++factorizations_;
    scaled_.factorize(problem);
}

sdk::Outcome PartitionedGradient::solve(const sdk::LocalProblemView& problem, const sdk::Request& request,
                                        sdk::MutableVectorView x, sdk::MutableVectorView lambda) {
    const Session session;
    CostMeter& meter = *scaled_.processes().meter();
    meter.begin(problem.raw->m_all, 4000);
    scaled_.load(problem);
    Run run{problem, scaled_, request, sdk::Monitor(request, stall_iterations_)};
    lambda_.setZero(problem.m);
    if (request.warm_start() && !scaled_.processes().any(!lambda.allFinite()))
        lambda_ = lambda.array() / scaled_.scaling().array();
    scaled_.project(lambda_);
    for (sdk::Vector* v : {&velocity_, &next_, &next_velocity_, &point_, &point_velocity_, &change_, &product_})
        v->setZero(problem.m);
    iterate(run);
    meter.clock().end_iterations();
    for (sdk::Vector* v :
         {&lambda_, &velocity_, &next_, &next_velocity_, &point_, &point_velocity_, &change_, &product_})
        v->resize(0);
    const sdk::Vector& best = run.monitor.best();
    if (scaled_.processes().any(best.size() != problem.m || !best.allFinite())) {
        lambda.setZero();
    } else {
        lambda = best;
    }
    scaled_.velocity(problem, lambda, x);
    sdk::Outcome& outcome = run.monitor.outcome();
    outcome.cost = meter.end();
    if (const int processes = scaled_.processes().size(); processes > 1 && outcome.message.empty()) {
        char text[96];
        std::snprintf(text, sizeof text, "%d processes together send %.3g MB an iteration", processes,
                      1e-6 * static_cast<double>(scaled_.bytes_a_product()));
        outcome.message = text;
    }
    return outcome;
}

// û is affine in λ̂, so that û of the extrapolated point is the extrapolation of û: one product with N̂ an iteration.
void PartitionedGradient::iterate(Run& run) {
    scaled_.gradient(lambda_, velocity_);
    run.unscaled = lambda_.cwiseProduct(scaled_.scaling());
    if (run.judge(scaled_.natural(lambda_, velocity_))) return;
    next_ = lambda_;
    next_velocity_ = velocity_;
    step_ = 1.0;
    double theta = 1.0, momentum = 0.0;
    while (true) {
        scaled_.processes().meter()->clock().next_iteration();
        if (gradient_step(run, momentum)) return;
        if (run.judge(natural_)) return;

        // Restart where the gradient mapping (y − λ⁺)/t points against the motion (O'Donoghue and Candès 2015, eq. 13).
        const bool restart = restart_ && uphill_ < 0.0;
        const double next_theta = restart ? 1.0 : 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * theta * theta));
        momentum = restart ? 0.0 : (theta - 1.0) / next_theta;
        theta = next_theta;
        if (run.stale || run.iteration % refresh_interval == 0) {
            scaled_.gradient(next_, next_velocity_);
            scaled_.gradient(lambda_, velocity_);
        }
        lambda_.swap(next_);
        velocity_.swap(next_velocity_);
        step_ = std::min(growth_ * step_, longest_step);
    }
}

// next = Π(y − t û(y)) with the largest t that backtracking allows: t dᵀN̂d ≤ ‖d‖², which is the test of the quadratic
// model without a difference of values of f (plugins/apgd/apgd.cpp has the derivation). All four sums of a step go
// through one reduction. A step that backtracking has set to ‖d‖²/dᵀN̂d meets the test as an equation, and rounding,
// which differs between numbers of processes, must not decide it. On entry next and its û are the iterate before λ̂,
// from which the first pass extrapolates to y. True: stop.
bool PartitionedGradient::gradient_step(Run& run, double momentum) {
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
            part.of(run.unscaled) = part.of(next_).cwiseProduct(part.of(scaled_.scaling()));
            return std::array{part.of(change_).dot(part.of(product_)),
                              part.of(change_).dot(part.of(next_) - part.of(lambda_)),
                              scaled_.natural_square(part, next_, next_velocity_)};
        };
        const auto [square, curvature, uphill, natural] =
            scaled_.sums_about_product<1, 3>(change_, step_and_project, judge);
        natural_ = scaled_.natural_from(natural);
        uphill_ = uphill;
        if (!(step_ * curvature > (1.0 + rounding) * square)) return false;
        run.unscaled = lambda_.cwiseProduct(scaled_.scaling());
        if (run.count()) return true;
        step_ = std::min(shrinkage_ * step_, square / curvature);
    }
}

}  // namespace delassus::petsc
