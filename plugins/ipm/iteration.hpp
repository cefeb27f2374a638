// SPDX-License-Identifier: BSD-3-Clause
// Primal-dual interior point method for the convex problem of the associated law (README.md): the iteration, for one
// process and for the processes of a problem in parts (plugins/ipm_petsc).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>

#include "delassus/sdk/monitor.hpp"
#include "refinement.hpp"

namespace delassus::ipm {

inline constexpr delassus_option step_fraction_option =
    sdk::real_option("step_fraction", "0.99", 0.5, 0.9999, "", "part of the way to the boundary that a step may take");
inline constexpr delassus_option regularization_option =
    sdk::real_option("regularization", "1e-13", 1e-15, 1e-4, "",
                     "static regularisation of the rows, relative to the diagonal of N; refinement removes its effect");
inline constexpr delassus_option refinements_option =
    sdk::integer_option("refinements", "3", 0, 100, "", "largest number of refinements of a linear solve");

/// System: Equations (equations.hpp), or what has its operations for the rows of one process. Iterates are in its
/// scaled variables (scaled_system.hpp).
template <class System>
class Iteration {
public:
    Iteration(const sdk::OptionValues& options, System system)
        : system_(std::move(system)),
          step_fraction_(options.real("step_fraction")),
          stall_iterations_(options.integer("stall_iterations")) {}

    [[nodiscard]] System& system() { return system_; }
    [[nodiscard]] const System& system() const { return system_; }

    /// Leaves the best iterate in x (n) and lambda (m), where the start is.
    [[nodiscard]] sdk::Outcome solve(const typename System::View& problem, const sdk::Request& request,
                                     sdk::MutableVectorView x, sdk::MutableVectorView lambda) {
        return solve_by(
            [this](sdk::Monitor& monitor, Beginning beginning) {
                if (beginning == Beginning::Cold) start_cold();
                if (beginning == Beginning::Warm) start_warm(monitor.best_residual());
                iterate(monitor, beginning == Beginning::Resumed);
            },
            problem, request, x, lambda);
    }

protected:
    using Start = typename Refinement<typename System::Linear>::Start;

    enum class Beginning {
        Cold,    ///< at zero
        Warm,    ///< at the start that was given
        Resumed  ///< where the last loop stopped
    };

    /// One solve whose iterations are those of loop(monitor, beginning).
    template <class Loop>
    [[nodiscard]] sdk::Outcome solve_by(const Loop& loop, const typename System::View& problem,
                                        const sdk::Request& request, sdk::MutableVectorView x,
                                        sdk::MutableVectorView lambda) {
        sdk::Monitor monitor(request, 0);
        iteration_ = 0;
        if (request.resume()) {
            monitor.go_on(lambda, best_error_);
            loop(monitor, Beginning::Resumed);
        } else {
            start(loop, monitor, problem, request, x, lambda);
        }
        best_error_ = monitor.best_residual();
        system_.end_iterations();
        const bool proof = monitor.outcome().status == DELASSUS_INFEASIBLE;  // the directions along which they diverge
        lambda = proof ? true_lambda_ : monitor.best();
        x = proof ? true_x_ : best_x_;
        std::string& message = monitor.outcome().message;
        message += (message.empty() ? "" : "; ") + system_.description();
        return monitor.outcome();
    }

    /// Runs loop(monitor, beginning) unless the given start, or zero, is good enough.
    template <class Loop>
    void start(const Loop& loop, sdk::Monitor& monitor, const typename System::View& problem,
               const sdk::Request& request, const sdk::MutableVectorView& x, const sdk::MutableVectorView& lambda) {
        system_.load(problem, cones_);
        const bool warm = request.warm_start() && system_.everywhere(lambda.allFinite() && x.allFinite());
        true_lambda_ = warm ? sdk::Vector(lambda) : sdk::Vector::Zero(problem.m);
        true_x_ = warm ? sdk::Vector(x) : sdk::Vector::Zero(problem.n);
        for (const delassus_cone& cone : problem.cones) sdk::project(cone, true_lambda_.data() + cone.first_row);
        best_x_ = true_x_;
        least_error_ = least_rest_ = infinity;
        idle_iterations_ = 0;
        if (!judge(monitor)) loop(monitor, warm ? Beginning::Warm : Beginning::Cold);
    }

    /// Judges the iterate in true_x_, true_lambda_; true: stop.
    bool judge(sdk::Monitor& monitor) {
        error_ = system_.measure(true_x_, true_lambda_);
        if (!(error_ >= monitor.best_residual())) best_x_ = true_x_;
        return monitor.check(iteration_, system_.definite() ? nullptr : true_x_.data(), true_lambda_, error_);
    }
    /// The same of x̂ and ẑ, after a step.
    bool judge_step(sdk::Monitor& monitor) {
        ++iteration_;
        true_lambda_ = system_.z_scale().cwiseProduct(cones_.z());
        true_x_ = system_.x_scale().cwiseProduct(x_);
        return judge(monitor);
    }

    // The minimum of ½ ẑᵀ(N̂ + θ)ẑ + r̂ᵀẑ without cones, where ŝ = −θ ẑ, moved into the interior (Vandenberghe 2010,
    // section 7.3, has θ = 1). With a small θ the reactions reach the size that a heavy body on light ones needs.
    void start_cold() {
        constexpr double theta = 0.01;
        const sdk::Vector zero = sdk::Vector::Zero(system_.b().size());
        cones_.start(zero, zero, 1.0, theta);
        cones_.scale(theta_);
        system_.factorize(cones_, theta_);
        right_ = -system_.b();
        cones_.rows_to_basis(right_);
        system_.solve(cones_, system_.a(), right_, System::start_residual, Start::Zero, x_, dz_);
        cones_.reactions_from_basis(dz_);
        const double mean = system_.norm(dz_) / std::sqrt(std::max(system_.rows(), 1.0));
        const double size = std::max(mean, 1e-2);
        cones_.start(dz_, -theta * dz_, size, 10.0 * theta * size);
    }

    void start_warm(double error) {
        x_ = true_x_.cwiseQuotient(system_.x_scale());
        const sdk::Vector z = true_lambda_.cwiseQuotient(system_.z_scale());
        const double margin = std::clamp(error, 1e-8, 1.0);
        cones_.start(z, system_.b() + system_.times_D(x_) + system_.times_E(z), margin, margin);
    }

    void find_residuals() {
        system_.find_residuals(x_, cones_, f_, g_);
        for (Eigen::Index i = 0; i < g_.size(); ++i)
            if (cones_.is_held(i)) g_[i] = 0.0;
    }

    /// δ for the target in target_, to a relative residual of `enough`.
    void find_direction(double enough, Start start = Start::Zero) {
        right_ = target_ + g_;
        system_.solve(cones_, f_, right_, enough, start, dx_, dz_);
        cones_.set_direction(dz_);
    }

    bool move(double length) {
        if (!system_.everywhere(dx_.allFinite() && dz_.allFinite()) || !(length > 0.0)) return false;
        x_ += length * dx_;
        cones_.advance(length);
        return true;
    }

    // Progress is a smaller natural error, or smaller residuals and products: the natural error follows those later.
    bool is_stuck(double error) {
        const double rest = std::max(cones_.mean_product(), system_.norm(f_, g_));
        ++idle_iterations_;
        if (error < 0.99 * least_error_ || rest < 0.9 * least_rest_) idle_iterations_ = 0;
        least_error_ = std::min(least_error_, error);
        least_rest_ = std::min(least_rest_, rest);
        return stall_iterations_ > 0 && idle_iterations_ >= stall_iterations_;
    }
    static void stall(sdk::Monitor& monitor, std::string message) {
        monitor.outcome().status = DELASSUS_STALLED;
        monitor.outcome().message = std::move(message);
    }
    void stall_idle(sdk::Monitor& monitor) const {
        stall(monitor, "no progress for " + std::to_string(stall_iterations_) + " iterations");
    }
    static void stall_outside(sdk::Monitor& monitor) {
        stall(monitor, "rounding leaves no step that stays inside the cones");
    }

    static constexpr double infinity = std::numeric_limits<double>::infinity();

    System system_;
    typename System::Cones cones_;
    double step_fraction_;
    std::int64_t stall_iterations_, iteration_ = 0, idle_iterations_ = 0;

    sdk::Vector x_;                                 // x̂
    sdk::Vector f_, g_;                             // what is left of the two equations
    sdk::Vector theta_, target_, right_, dx_, dz_;  // of a step
    sdk::Vector true_x_, true_lambda_;              // in the problem's units
    double error_ = 0.0;                            // of the latest iterate

private:
    // ‖S r‖ = 1 in scaled units. A solution larger than the data by this factor counts as none.
    static constexpr double largest_solution = 1e9;

    // judged: the iterate was judged by the loop that stopped.
    void iterate(sdk::Monitor& monitor, bool judged) {
        for (;; judged = false) {
            if (!judged) {
                system_.next_iteration();
                find_residuals();
                if (!step()) return stall_outside(monitor);
                if (judge_step(monitor)) return;
            }
            if (const double size = proven_size(); size > largest_solution) {
                char text[160];
                std::snprintf(
                    text, sizeof text,
                    "there is no solution: in units of the data, x or the reactions would have to exceed %.1e", size);
                monitor.outcome().status = DELASSUS_INFEASIBLE;
                monitor.outcome().message = text;
                return;
            }
            if (is_stuck(monitor.best_residual())) return stall_idle(monitor);
        }
    }

    // Mehrotra's predictor and corrector. With H (or E) both equations contain z, so one step length serves all.
    bool step() {
        [[maybe_unused]] const auto span = system_.on_cones();
        cones_.scale(theta_);
        system_.factorize(cones_, theta_);
        const double equations = system_.norm(f_, g_);
        cones_.rows_to_basis(g_);
        cones_.target_zero(target_);
        const double tau = cones_.mean_product();
        find_direction(tau > 0.0 ? System::predictor_residual : System::tightest_residual);
        if (tau > 0.0) {
            const double predicted = std::min(1.0, cones_.longest_step());
            const double ratio = std::clamp(cones_.mean_product(predicted) / tau, 0.0, 1.0);
            const double aim = ratio * ratio * ratio * tau;
            const double enough = System::corrector_residual(tau, cones_.degree(), equations);
            cones_.target(aim, true, target_);
            find_direction(enough, Start::Given);
            correct(aim, enough);
        }
        return move(std::min(1.0, step_fraction_ * cones_.longest_step()));
    }

    // Gondzio's centrality correctors (1996): some products would leave the neighbourhood of the path in a step half as
    // long again; the target is changed by what these miss, and the direction is solved for once more. Where contacts
    // are degenerate, steps would otherwise stay at half of the way.
    void correct(double tau, double enough) {
        constexpr double outlier = 0.1;  // products between outlier τ and τ/outlier are left as they are
        const std::int64_t most = system_.correctors();
        if (most == 0) return;
        double longest = std::min(1.0, cones_.longest_step());
        for (std::int64_t k = 0; k < most && longest < 0.95; ++k) {
            cones_.correct(std::min(1.0, 1.5 * longest + 0.3), outlier * tau, tau / outlier, target_);
            kept_x_ = dx_;
            kept_z_ = dz_;
            find_direction(enough, Start::Given);
            const double next = std::min(1.0, cones_.longest_step());
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

    // A lower bound of ‖(x̂, ẑ)‖ over all solutions that the iterates prove; zero if they prove nothing.
    //
    // Let d lie in the recession cone of the reactions. Every solution has ŝᵀd ≥ 0 there, hence
    //     −b̂ᵀd ≤ x̂ᵀD̂ᵀd + ẑᵀÊ d ≤ ‖(x̂, ẑ)‖ ‖(D̂ᵀd, Ê d)‖.
    // Likewise y with D̂y in the dual of that cone, at the distance ε: âᵀy = x̂ᵀĤy − ẑᵀD̂y ≤ ‖(x̂, ẑ)‖ (‖Ĥy‖ + ε) (bounded
    // rows, whose ẑᵀD̂y is bounded too, count as if their D̂y had to vanish). Where no solution exists, ẑ or x̂ diverges
    // along such a direction; with a definite H only ẑ does.
    [[nodiscard]] double proven_size() const {
        const auto bound = [](double gain, double cost) {
            return gain <= 0.0 ? 0.0 : cost > 0.0 ? gain / cost : infinity;
        };
        sdk::Vector d = cones_.z();
        cones_.project_to_recession(d);
        const double cost = system_.norm(system_.times_transposed_D(d)) + system_.norm(system_.times_E(d));
        double size = bound(-system_.dot(system_.b(), d), cost + 1e-15 * system_.norm(d));
        if (!system_.definite()) {
            const double loss =
                system_.norm(system_.times_H(x_)) + cones_.distance_to_recession_dual(system_.times_D(x_));
            size = std::max(size, bound(system_.dot(system_.a(), x_), loss + 1e-15 * system_.norm(x_)));
        }
        return size;
    }

    sdk::Vector best_x_;                           // in the problem's units
    sdk::Vector kept_x_, kept_z_;                  // δx and δz before a corrector
    double least_error_ = 0.0, least_rest_ = 0.0;  // of is_stuck
    double best_error_ = 0.0;                      // of the iterates since the start
};

}  // namespace delassus::ipm
