// SPDX-License-Identifier: BSD-3-Clause
#include "spg.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace delassus::spg {

namespace {

using Part = sdk::ScaledProblem::Part;

constexpr double sufficient_decrease = 1e-4;                  // of Armijo's rule
constexpr double shortest_step = 1e-10, longest_step = 1e10;  // of a gradient step; N̂ has unit diagonal on the average
constexpr std::int64_t refresh_interval = 200;                // iterations between products that renew û
constexpr std::int64_t first_face_period = 30, longest_face_period = 100, shortest_face_period = 10;
constexpr std::int64_t face_products = 100;
constexpr double face_accuracy = 0.01;

}  // namespace

SpectralGradient::SpectralGradient(const sdk::OptionValues& options)
    : steps_(options.choice("steps") == "long" ? Steps::Long : Steps::Alternating),
      memory_(static_cast<std::size_t>(options.integer("memory"))),
      tangential_(options.boolean("tangential")),
      face_steps_(options.boolean("face_steps")),
      stall_iterations_(options.integer("stall_iterations")) {}

sdk::Outcome SpectralGradient::solve(const sdk::ProblemView& problem, const sdk::Request& request,
                                     sdk::MutableVectorView x, sdk::MutableVectorView lambda) {
    scaled_.load(problem);
    sdk::ScaledRun run(problem, scaled_, request, stall_iterations_);
    lambda_ = run.start(lambda);
    for (sdk::Vector* v : {&gradient_, &direction_, &product_}) v->setZero(problem.m);
    history_.assign(memory_, -std::numeric_limits<double>::infinity());
    face_.reset(scaled_);
    face_period_ = first_face_period;
    since_face_ = 0;
    iterate(run, sdk::ScaledProblem::useful(team(), problem));
    return run.finish(x, lambda);
}

// One product with N̂ an iteration: f is quadratic, so that N̂ d gives f, û and both spectral steps anywhere on the
// segment from λ̂ to Π(λ̂ − α û). Changes of f are formed without subtracting values of f, which would lose all digits
// near the solution.
void SpectralGradient::iterate(sdk::ScaledRun& run, const sdk::Team& team) {
    scaled_.gradient(lambda_, gradient_);
    if (run.check(lambda_, gradient_)) return;
    double alpha = 1.0;
    history_[oldest_ = 0] = 0.0;
    while (true) {
        if (face_steps_ && ++since_face_ > face_period_) {
            if (take_face_step(run)) return;
            alpha = 1.0;
        }
        const auto project = [&](const Part& part) {
            part.of(direction_) = part.of(lambda_) - alpha * part.of(gradient_);
            scaled_.project(part, direction_);
            part.of(direction_) -= part.of(lambda_);
            return std::array{part.of(gradient_).dot(part.of(direction_)), part.of(direction_).squaredNorm()};
        };
        const auto multiply = [&](const Part& part) {
            scaled_.finish_product(part, product_);
            return std::array{part.of(direction_).dot(part.of(product_))};
        };
        const auto [slope, square, curvature] = scaled_.sums_about_product<2, 1>(team, direction_, project, multiply);
        const double length = line_search(slope, curvature);
        const auto [natural] = scaled_.sums_over_parts<1>(team, [&](const Part& part) {
            part.of(lambda_) += length * part.of(direction_);
            part.of(gradient_) += length * part.of(product_);
            part.of(run.unscaled()) = part.of(lambda_).cwiseProduct(part.of(scaled_.scaling()));
            return std::array{scaled_.natural_square(part, lambda_, gradient_)};
        });
        if (run.judge(scaled_.natural_from(natural))) return;
        if (run.stale() || run.iteration() % refresh_interval == 0) scaled_.gradient(lambda_, gradient_);
        alpha = next_step(run.iteration(), square, curvature);
    }
}

// Grippo, Lampariello and Lucidi: f may grow, but not above the largest of its last `memory` values. A full step that
// fails is cut to the minimum of f on the segment, which meets the rule for any constant up to ½.
// f(λ̂ + γ d) − f(λ̂) = γ ûᵀd + ½ γ² dᵀN̂d; slope = ûᵀd, curvature = dᵀN̂d.
double SpectralGradient::line_search(double slope, double curvature) {
    double length = 1.0;
    double change = slope + 0.5 * curvature;
    const double largest = *std::max_element(history_.begin(), history_.end());
    // A slope that is not negative is rounding: the direction is one of descent or zero.
    if (slope < 0.0 && change > largest + sufficient_decrease * slope) {
        length = std::min(1.0, -slope / curvature);
        change = length * slope + 0.5 * length * length * curvature;
    }
    for (double& value : history_) value -= change;
    oldest_ = (oldest_ + 1) % history_.size();
    history_[oldest_] = 0.0;
    return length;
}

// Barzilai and Borwein's steps, with s ∝ d and y ∝ N̂ d: sᵀs/sᵀy (long) and sᵀy/yᵀy (short), in turn. In the short one
// y is projected onto the tangent space T of the face, where alone f can be minimised: the other part of y holds
// multipliers of the constraints and makes the step too short (Crisci, Porta, Ruggiero and Zanni 2020 for boxes).
double SpectralGradient::next_step(std::int64_t iteration, double square, double curvature) {
    if (!(curvature > 0.0)) return square > 0.0 ? longest_step : 1.0;
    if (steps_ == Steps::Long || iteration % 2 == 0) return std::clamp(square / curvature, shortest_step, longest_step);
    double change = product_.squaredNorm();
    if (tangential_) {
        face_.identify(scaled_, lambda_, gradient_);
        face_.tangent(scaled_, product_, direction_);
        if (const double along = direction_.squaredNorm(); along > 0.0) change = along;
    }
    return std::clamp(curvature / change, shortest_step, longest_step);
}

// True: stop.
bool SpectralGradient::take_face_step(sdk::ScaledRun& run) {
    since_face_ = 0;
    const double before = run.residual();
    const auto result =
        face_.step(scaled_, lambda_, gradient_, face_products, face_accuracy, [&run] { return run.count(); });
    if (result == sdk::FaceStep::Result::Stopped) return true;
    bool converging = false;
    if (result == sdk::FaceStep::Result::Improved) {
        if (run.check(lambda_, gradient_)) return true;
        if (run.stale()) scaled_.gradient(lambda_, gradient_);
        std::fill(history_.begin(), history_.end(), -std::numeric_limits<double>::infinity());
        history_[oldest_] = 0.0;
        converging = run.residual() < 0.5 * before;
    }
    if (converging) {
        face_period_ = std::max(shortest_face_period, face_period_ / 2);
        since_face_ = face_period_;  // once more after one gradient step
    } else {
        face_period_ = std::min(2 * face_period_, longest_face_period);
    }
    return false;
}

}  // namespace delassus::spg
