// SPDX-License-Identifier: BSD-3-Clause
#include "interior_point.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace delassus::petsc {

namespace {

// ‖S r‖ = 1 in scaled units. A solution larger than the data by this factor counts as none.
constexpr double largest_solution = 1e9;
constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace

PartitionedInteriorPoint::PartitionedInteriorPoint(const sdk::OptionValues& options)
    : kkt_(options.choice("preconditioner"),
           {options.integer("subdomain"), static_cast<int>(options.integer("overlap"))}, options.real("regularization"),
           static_cast<int>(options.integer("refinements")), options.integer("inner_iterations")),
      step_fraction_(options.real("step_fraction")),
      correctors_(options.integer("correctors")),
      stall_iterations_(options.integer("stall_iterations")) {
    ensure_petsc();
}

PartitionedInteriorPoint::~PartitionedInteriorPoint() {
    const Session session;
    kkt_ = CondensedSystem("", {}, 0.0, 0, 0);
    system_ = {};
}

std::string PartitionedInteriorPoint::refusal(const sdk::ProblemView& problem) {
    return refusal_of_compliance(problem);
}

void PartitionedInteriorPoint::analyze(const sdk::LocalProblemView& problem) {
    const Session session;
    const Processes processes(*problem.raw);
    system_.analyze(processes, problem);
    kkt_.analyze(system_, problem);
}

void PartitionedInteriorPoint::factorize(const sdk::LocalProblemView& problem) {
    const Session session;
    system_.factorize(problem);
}

// As ipm::Scaling: diag(1/μ, 1, 1) makes friction cones self-dual, and N has a unit diagonal on average.
void PartitionedInteriorPoint::find_scales(const sdk::LocalProblemView& problem) {
    const sdk::Vector& diagonal = system_.diagonal();
    double rho = system_.reference();
    if (problem.raw->m_all == 0) {
        const double size = system_.norm(problem.a.cwiseProduct(kkt_.R()));
        if (size > 0.0) rho = size;
    }
    std::array<double, 2> sums = {diagonal.sum(), static_cast<double>((diagonal.array() > 0.0).count())};
    processes().sum(sums);
    const double mean = sums[1] > 0.0 ? sums[0] / sums[1] : 1.0;
    for (std::int64_t c = 0; c < problem.raw->cone_count; ++c) {
        const delassus_cone& cone = problem.cone(c);
        const bool friction = cone.kind == DELASSUS_CONE_FRICTION;
        const double mu = friction ? sdk::friction_coefficient(cone) : 0.0;
        const double normal = mu > 0.0 ? 1.0 / mu : 1.0;
        double square = 0.0;
        for (std::int32_t i = 0; i < cone.rows; ++i)
            square += diagonal[cone.first_row + i] * (i == 0 ? normal * normal : 1.0) / cone.rows;
        for (std::int32_t i = 0; i < cone.rows; ++i) {
            const double size = friction ? square : diagonal[cone.first_row + i];
            p_[cone.first_row + i] = (i == 0 && friction ? normal : 1.0) / std::sqrt(size > 0.0 ? size : mean);
        }
    }
    scales_.z_scale = rho * p_;
    a_ = problem.a / rho;
    b_ = problem.b.cwiseProduct(p_) / rho;
    kkt_.load(system_, problem, p_);
    // products of all, for their mean
    cones_.load(system_.rows(), scales_);
    degree_ = processes().sum(cones_.degree());
}

sdk::Outcome PartitionedInteriorPoint::solve(const sdk::LocalProblemView& problem, const sdk::Request& request,
                                             sdk::MutableVectorView x, sdk::MutableVectorView lambda) {
    const Session session;
    CostMeter& meter = *processes().meter();
    meter.begin(problem.raw->m_all, 0);
    system_.load(problem);
    p_.setOnes(problem.m);
    kkt_.load(system_, problem, p_);  // R
    find_scales(problem);
    const bool warm = request.warm_start() && !processes().any(!lambda.allFinite() || !x.allFinite());
    true_lambda_ = warm ? sdk::Vector(lambda) : sdk::Vector::Zero(problem.m);
    for (std::int64_t c = 0; c < problem.raw->cone_count; ++c)
        sdk::project(problem.cone(c), true_lambda_.data() + problem.cone(c).first_row);
    least_error_ = least_rest_ = infinity;
    idle_iterations_ = 0;
    sdk::Monitor monitor(request, 0);
    if (!judge(problem, monitor, 0)) {
        if (warm) {
            start_warm(monitor.best_residual());
        } else {
            start_cold(problem);
        }
        iterate(problem, monitor);
    }
    meter.clock().end_iterations();
    const bool proof = monitor.outcome().status == DELASSUS_INFEASIBLE;  // the directions along which they diverge
    const sdk::Vector& best = monitor.best();
    if (proof) {
        lambda = true_lambda_;
        x = true_x_;
    } else {
        if (!processes().any(best.size() != problem.m || !best.allFinite())) {
            lambda = best;
        } else {
            lambda.setZero();
        }
        x = system_.velocity(problem, lambda);
    }
    std::string& message = monitor.outcome().message;
    message += (message.empty() ? "" : "; ") + kkt_.description();
    monitor.outcome().cost = meter.end();
    return monitor.outcome();
}

bool PartitionedInteriorPoint::judge(const sdk::LocalProblemView& problem, sdk::Monitor& monitor,
                                     std::int64_t iteration) {
    const double error = system_.measured(problem, true_lambda_, true_x_);
    return monitor.check(iteration, nullptr, true_lambda_, error);
}

double PartitionedInteriorPoint::mean_product(double step) const {
    if (!(degree_ > 0.0)) return 0.0;
    return processes().sum(cones_.mean_product(step) * cones_.degree()) / degree_;
}

// The minimum of ½ ẑᵀ(N̂ + θ)ẑ + r̂ᵀẑ without cones, where ŝ = −θ ẑ, moved into the interior (plugins/ipm).
void PartitionedInteriorPoint::start_cold(const sdk::LocalProblemView& problem) {
    constexpr double theta = 0.01;
    const sdk::Vector zero = sdk::Vector::Zero(problem.m);
    cones_.start(zero, zero, 1.0, theta);
    cones_.scale(theta_);
    kkt_.factorize(problem, cones_, theta_);
    right_ = -b_;
    cones_.rows_to_basis(right_);
    kkt_.solve(cones_, a_, right_, 1e-3, Start::Zero, x_, dz_);
    cones_.reactions_from_basis(dz_);
    const double square = system_.dot(dz_, dz_);
    const double size =
        std::max(std::sqrt(square / std::max<double>(1.0, static_cast<double>(problem.raw->m_all))), 1e-2);
    cones_.start(dz_, -theta * dz_, size, 10.0 * theta * size);
}

void PartitionedInteriorPoint::start_warm(double error) {
    const double rho = system_.reference();
    x_ = true_x_ / rho;
    const sdk::Vector z = true_lambda_.cwiseQuotient(scales_.z_scale);
    const sdk::Vector s = b_ + p_.cwiseProduct(system_.apply_D(x_)) + kkt_.apply_E(z);
    const double margin = std::clamp(error, 1e-8, 1.0);
    cones_.start(z, s, margin, margin);
}

void PartitionedInteriorPoint::find_residuals() {
    const sdk::Vector& z = cones_.z();
    f_ = a_ - system_.apply_H(x_) + system_.apply_transpose(p_.cwiseProduct(z));
    g_ = cones_.u() - b_ - p_.cwiseProduct(system_.apply_D(x_)) - kkt_.apply_E(z);
    for (Eigen::Index i = 0; i < g_.size(); ++i)
        if (cones_.is_held(i)) g_[i] = 0.0;
}

// Mehrotra's predictor and corrector with inexact directions. What a linear solve leaves stays in the equations after
// the step; it does no harm while it falls faster than the products do. With the mean product τ the corrector is solved
// to
//     rest ≤ 0.1 min(τ, √τ · (what is left of the equations))·√(number of products)
// relative to its right-hand side, between 1e-10 and 1e-3: the forcing sequence. (Bellavia 1998 has such a bound, in
// τ alone.) The predictor is a forecast only, for which 1e-2 is enough.
bool PartitionedInteriorPoint::step(const sdk::LocalProblemView& problem) {
    constexpr double predictor_residual = 1e-2, loosest = 1e-3, tightest = 1e-10;
    // All but products, linear systems and sums is work on the cones.
    const auto span = processes().meter()->span(DELASSUS_PHASE_PROJECTIONS);
    cones_.scale(theta_);
    kkt_.factorize(problem, cones_, theta_);
    const double equations = std::sqrt(processes().sum(f_.cwiseProduct(kkt_.R()).squaredNorm() + g_.squaredNorm()));
    cones_.rows_to_basis(g_);
    cones_.target_zero(target_);
    const double tau = mean_product(0.0);
    find_direction(tau > 0.0 ? predictor_residual : tightest, Start::Zero);
    if (tau > 0.0) {
        const double predicted = std::min(1.0, longest_step());
        const double ratio = std::clamp(mean_product(predicted) / tau, 0.0, 1.0);
        cones_.target(ratio * ratio * ratio * tau, true, target_);
        const double size = std::sqrt(degree_) * std::sqrt(tau);
        const double forcing =
            0.1 * std::min(std::sqrt(degree_) * tau, std::sqrt(tau) * std::max(equations, std::sqrt(degree_) * tau));
        const double enough = std::clamp(forcing / std::max(size, equations), tightest, loosest);
        find_direction(enough, Start::Given);
        if (kkt_.is_direct()) correct(ratio * ratio * ratio * tau, enough);
    }
    const double length = std::min(1.0, step_fraction_ * longest_step());
    if (processes().any(!dx_.allFinite() || !dz_.allFinite()) || !(length > 0.0)) return false;
    x_ += length * dx_;
    cones_.advance(length);
    return true;
}

// Gondzio's centrality correctors (1996): some products would leave the neighbourhood of the path in a step half as
// long again; the target is changed by what these miss, and the direction is solved for once more. A factorisation
// costs as much as dozens of such solves. Where contacts are degenerate, steps would otherwise stay at half of the way.
void PartitionedInteriorPoint::correct(double tau, double enough) {
    constexpr double outlier = 0.1;  // products between outlier τ and τ/outlier are left as they are
    double longest = std::min(1.0, longest_step());
    for (std::int64_t k = 0; k < correctors_ && longest < 0.95; ++k) {
        cones_.correct(std::min(1.0, 1.5 * longest + 0.3), outlier * tau, tau / outlier, target_);
        kept_x_ = dx_;
        kept_z_ = dz_;
        find_direction(enough, Start::Given);
        const double next = std::min(1.0, longest_step());
        if (next < longest) {
            dx_.swap(kept_x_);
            dz_.swap(kept_z_);
            cones_.undo_correction();
            cones_.set_direction(dz_);
        }
        if (!(next > longest + 0.01)) return;
        longest = next;
    }
}

void PartitionedInteriorPoint::find_direction(double enough, Start start) {
    right_ = target_ + g_;
    kkt_.solve(cones_, f_, right_, enough, start, dx_, dz_);
    cones_.set_direction(dz_);
}

void PartitionedInteriorPoint::iterate(const sdk::LocalProblemView& problem, sdk::Monitor& monitor) {
    sdk::Outcome& outcome = monitor.outcome();
    std::int64_t iteration = 0;
    while (true) {
        processes().meter()->clock().next_iteration();
        find_residuals();
        if (!step(problem)) {
            outcome.status = DELASSUS_STALLED;
            outcome.message = "rounding leaves no step that stays inside the cones";
            return;
        }
        true_lambda_ = scales_.z_scale.cwiseProduct(cones_.z());
        if (judge(problem, monitor, ++iteration)) return;
        if (const double size = proven_size(); size > largest_solution) {
            char text[160];
            std::snprintf(text, sizeof text,
                          "there is no solution: in units of the data the reactions would have to exceed %.1e", size);
            outcome.status = DELASSUS_INFEASIBLE;
            outcome.message = text;
            return;
        }
        if (!is_stuck(monitor.best_residual())) continue;
        outcome.status = DELASSUS_STALLED;
        outcome.message = "no progress for " + std::to_string(stall_iterations_) + " iterations";
        return;
    }
}

// Progress is a smaller natural error, or smaller residuals and products: the natural error follows those later.
bool PartitionedInteriorPoint::is_stuck(double error) {
    const double equations = std::sqrt(processes().sum(f_.cwiseProduct(kkt_.R()).squaredNorm() + g_.squaredNorm()));
    const double rest = std::max(mean_product(0.0), equations);
    ++idle_iterations_;
    if (error < 0.99 * least_error_ || rest < 0.9 * least_rest_) idle_iterations_ = 0;
    least_error_ = std::min(least_error_, error);
    least_rest_ = std::min(least_rest_, rest);
    return stall_iterations_ > 0 && idle_iterations_ >= stall_iterations_;
}

// plugins/ipm/interior_point.cpp has the derivation: d in the recession cone of the reactions with −b̂ᵀd > 0 bounds the
// size of every solution from below.
double PartitionedInteriorPoint::proven_size() const {
    sdk::Vector d = cones_.z();
    cones_.project_to_recession(d);
    const sdk::Vector impulse = system_.apply_transpose(p_.cwiseProduct(d)), yield = kkt_.apply_E(d);
    std::array<double, 4> sums = {-b_.dot(d), impulse.cwiseProduct(kkt_.R()).squaredNorm(), yield.squaredNorm(),
                                  d.squaredNorm()};
    processes().sum(sums);
    const double cost = std::sqrt(sums[1]) + std::sqrt(sums[2]) + 1e-15 * std::sqrt(sums[3]);
    return sums[0] <= 0.0 ? 0.0 : cost > 0.0 ? sums[0] / cost : infinity;
}

}  // namespace delassus::petsc
