// SPDX-License-Identifier: BSD-3-Clause
#include "interior_point.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace delassus::ipm {

namespace {

// ‖S r‖ = 1 in scaled units. A solution larger than the data by this factor counts as none.
constexpr double largest_solution = 1e9;

// With exact Coulomb, the error from which on semismooth Newton is the better way to end than hops.
constexpr double error_for_ssn = 1e-5;

KktSettings settings_from(const sdk::OptionValues& options) {
    const std::string form = options.choice("form");
    return {form == "normal"      ? Form::Normal
            : form == "augmented" ? Form::Augmented
                                  : Form::Automatic,
            options.real("regularization"), static_cast<int>(options.integer("refinements"))};
}

double root_mean_square(const sdk::Vector& v) {
    return v.size() > 0 ? v.norm() / std::sqrt(static_cast<double>(v.size())) : 0.0;
}

}  // namespace

InteriorPoint::InteriorPoint(const sdk::OptionValues& options)
    : kkt_(settings_from(options)),
      step_fraction_(options.real("step_fraction")),
      stall_iterations_(options.integer("stall_iterations")),
      shift_first_(options.choice("path") == "shift"),
      most_hops_(options.integer("hops")) {}

void InteriorPoint::analyze(const sdk::ProblemView& problem) {
    scaling_.analyze(problem);
    kkt_.analyze(problem);
}

sdk::Outcome InteriorPoint::solve(const sdk::ProblemView& problem, const sdk::Request& request,
                                  sdk::MutableVectorView x, sdk::MutableVectorView lambda) {
    scaling_.load(problem);
    cones_.load(problem, scaling_.system());
    kkt_.load(scaling_.system(), scaling_.definite());
    const bool warm = request.warm_start() && lambda.allFinite() && x.allFinite();
    true_lambda_ = warm ? sdk::Vector(lambda) : sdk::Vector::Zero(problem.m);
    true_x_ = warm ? sdk::Vector(x) : sdk::Vector::Zero(problem.n);
    for (const delassus_cone& cone : problem.cones) sdk::project(cone, true_lambda_.data() + cone.first_row);
    best_x_ = true_x_;
    least_error_ = least_rest_ = std::numeric_limits<double>::infinity();
    idle_iterations_ = slow_iterations_ = 0;
    halved_error_ = path_error_ = std::numeric_limits<double>::infinity();
    centre_next_ = 0;
    jam_ = 0.0;
    hops_ = 0;
    rise_ = 1.0;
    lowest_tau_ = std::numeric_limits<double>::infinity();
    is_stopped_ = false;
    sdk::Monitor monitor(request, 0);
    if (!judge(problem, monitor, 0)) {
        if (warm && !problem.coulomb) {  // with exact Coulomb a good iterate may lie far from the path
            start_warm(problem, monitor.best_residual());
        } else {
            start_cold();
            if (problem.coulomb && shift_first_) cones_.take_shift_path();
        }
        iterate(problem, monitor);
    }
    const bool proof = monitor.outcome().status == DELASSUS_INFEASIBLE;  // the directions along which they diverge
    if (proof) {
        lambda = true_lambda_;
    } else if (monitor.best().size() == problem.m) {
        lambda = monitor.best();
    }
    x = proof ? true_x_ : best_x_;
    std::string& message = monitor.outcome().message;
    message += (message.empty() ? "" : "; ") + kkt_.description();
    return monitor.outcome();
}

bool InteriorPoint::judge(const sdk::ProblemView& problem, sdk::Monitor& monitor, std::int64_t iteration) {
    const Scaling::Error error = scaling_.measure(problem, true_x_, true_lambda_);
    // The host accepts any balance below 1e-12.
    const double worst = error.balance > 1e-12 ? std::max(error.natural, error.balance) : error.natural;
    if (!(worst >= monitor.best_residual())) best_x_ = true_x_;
    if (iteration > 0) path_error_ = std::min(path_error_, worst);
    return monitor.check(iteration, scaling_.definite() ? nullptr : true_x_.data(), true_lambda_, worst);
}

// The minimum of ½ ẑᵀ(N̂ + θ)ẑ + r̂ᵀẑ without cones, where ŝ = −θ ẑ, moved into the interior (Vandenberghe 2010, section
// 7.3, has θ = 1). With a small θ the reactions reach the size that a heavy body on light ones needs.
void InteriorPoint::start_cold() {
    constexpr double theta = 0.01;
    const ScaledSystem& system = scaling_.system();
    const sdk::Vector zero = sdk::Vector::Zero(system.b.size());
    cones_.start(zero, zero, 1.0, theta);
    cones_.scale(theta_);
    kkt_.factorize(cones_, theta_);
    right_ = -system.b;
    cones_.rows_to_basis(right_);
    kkt_.solve(cones_, system.a, right_, corrector_residual, x_, dz_);
    cones_.reactions_from_basis(dz_);
    const double size = std::max(root_mean_square(dz_), 1e-2);
    cones_.start(dz_, -theta * dz_, size, 10.0 * theta * size);
}

void InteriorPoint::start_warm(const sdk::ProblemView& problem, double error) {
    const ScaledSystem& system = scaling_.system();
    x_ = true_x_.cwiseQuotient(system.x_scale);
    const sdk::Vector z = true_lambda_.cwiseQuotient(system.z_scale);
    sdk::Vector s = system.b;
    if (problem.n > 0) s += system.D * x_;
    if (system.E.nonZeros() > 0) s += system.E * z;
    const double margin = std::clamp(error, 1e-8, 1.0);
    cones_.start(z, s, margin, margin);
}

void InteriorPoint::find_residuals() {
    const ScaledSystem& system = scaling_.system();
    const sdk::Vector& z = cones_.z();
    f_ = system.a;
    g_ = cones_.u() - system.b;
    if (f_.size() > 0) {
        f_.noalias() -= system.H * x_;
        f_.noalias() += system.D.transpose() * z;
        g_.noalias() -= system.D * x_;
    }
    if (system.E.nonZeros() > 0) g_.noalias() -= system.E * z;
    for (Eigen::Index i = 0; i < g_.size(); ++i)
        if (cones_.is_held(i)) g_[i] = 0.0;
}

// Mehrotra's predictor and corrector. With H (or E) both equations contain z, so one step length serves all.
bool InteriorPoint::step() {
    cones_.scale(theta_);
    kkt_.factorize(cones_, theta_);
    cones_.rows_to_basis(g_);
    cones_.target_zero(target_);
    const double tau = cones_.mean_product();
    find_direction(tau > 0.0 ? predictor_residual : corrector_residual);
    if (tau > 0.0) {
        const double predicted = std::min(1.0, cones_.longest_step());
        const double ratio = std::clamp(cones_.mean_product(predicted) / tau, 0.0, 1.0);
        cones_.target(ratio * ratio * ratio * tau, true, target_);
        find_direction(corrector_residual);
    }
    return move(std::min(1.0, step_fraction_ * cones_.longest_step()));
}

void InteriorPoint::find_direction(double enough) {
    right_ = target_ + g_;
    kkt_.solve(cones_, f_, right_, enough, dx_, dz_);
    cones_.set_direction(dz_);
}

bool InteriorPoint::move(double length) {
    if (!dx_.allFinite() || !dz_.allFinite() || !(length > 0.0)) return false;
    x_ += length * dx_;
    cones_.advance(length);
    return true;
}

void InteriorPoint::iterate(const sdk::ProblemView& problem, sdk::Monitor& monitor) {
    sdk::Outcome& outcome = monitor.outcome();
    const auto stall = [&outcome](std::string message) {
        outcome.status = DELASSUS_STALLED;
        outcome.message = std::move(message);
    };
    std::int64_t iteration = 0;
    const auto judge_iterate = [&] {
        true_lambda_ = scaling_.system().z_scale.cwiseProduct(cones_.z());
        true_x_ = scaling_.system().x_scale.cwiseProduct(x_);
        return judge(problem, monitor, ++iteration);
    };
    while (true) {
        find_residuals();
        if (!(problem.coulomb ? coulomb_step() : step()))
            return stall("rounding leaves no step that stays inside the cones");
        if (judge_iterate()) return;
        if (const double size = problem.coulomb ? 0.0 : proven_size(); size > largest_solution) {
            char text[160];
            std::snprintf(text, sizeof text,
                          "there is no solution: in units of the data, x or the reactions would have to exceed %.1e",
                          size);
            outcome.status = DELASSUS_INFEASIBLE;
            outcome.message = text;
            return;
        }
        if (problem.coulomb && is_jammed()) {
            if (path_error_ < error_for_ssn || !hop_on(judge_iterate)) {
                if (!is_stopped_) stall("the path to the solution ends: steps inside the cones stay short");
                return;
            }
        } else if (is_stuck(monitor.best_residual()) || (problem.coulomb && is_slow())) {
            return stall("no progress for " + std::to_string(stall_iterations_) + " iterations");
        }
    }
}

// Progress is a smaller natural error, or smaller residuals and products: the natural error follows those later.
bool InteriorPoint::is_stuck(double error) {
    const double rest = std::max({cones_.mean_product(), f_.norm(), g_.norm()});
    ++idle_iterations_;
    if (error < 0.99 * least_error_ || rest < 0.9 * least_rest_) idle_iterations_ = 0;
    least_error_ = std::min(least_error_, error);
    least_rest_ = std::min(least_rest_, rest);
    return stall_iterations_ > 0 && idle_iterations_ >= stall_iterations_;
}

// Near the end the error halves in a step or two, unless short steps or rounding hold it.
bool InteriorPoint::is_slow() {
    ++slow_iterations_;
    if (path_error_ < 0.5 * halved_error_) {
        halved_error_ = path_error_;
        slow_iterations_ = 0;
    }
    return path_error_ < error_for_ssn && stall_iterations_ > 0 && slow_iterations_ >= stall_iterations_;
}

// Let d lie in the recession cone of the reactions. Every solution has ŝᵀd ≥ 0 there, hence
//     −b̂ᵀd ≤ x̂ᵀD̂ᵀd + ẑᵀÊ d ≤ ‖(x̂, ẑ)‖ ‖(D̂ᵀd, Ê d)‖.
// Likewise y with D̂y in the dual of that cone, at the distance ε: âᵀy = x̂ᵀĤy − ẑᵀD̂y ≤ ‖(x̂, ẑ)‖ (‖Ĥy‖ + ε) (bounded
// rows, whose ẑᵀD̂y is bounded too, count as if their D̂y had to vanish). Where no solution exists, ẑ or x̂ diverges along
// such a direction.
double InteriorPoint::proven_size() const {
    const ScaledSystem& system = scaling_.system();
    const auto bound = [](double gain, double cost) {
        return gain <= 0.0 ? 0.0 : cost > 0.0 ? gain / cost : std::numeric_limits<double>::infinity();
    };
    sdk::Vector d = cones_.z();
    cones_.project_to_recession(d);
    const double gain = -system.b.dot(d);
    double cost = 0.0;
    if (x_.size() > 0) cost += (system.D.transpose() * d).norm();
    if (system.E.nonZeros() > 0) cost += (system.E * d).norm();
    double size = bound(gain, cost + 1e-15 * d.norm());
    if (!scaling_.definite()) {
        const double loss = (system.H * x_).norm() + cones_.distance_to_recession_dual(system.D * x_);
        size = std::max(size, bound(system.a.dot(x_), loss + 1e-15 * x_.norm()));
    }
    return size;
}

}  // namespace delassus::ipm
