// SPDX-License-Identifier: BSD-3-Clause
// The alternating direction method of multipliers for contact, as a fixed-point iteration (README.md): for one process,
// and for the processes of a problem in parts (plugins/admm_petsc).
//
// ADMM on  minimise ½xᵀHx − aᵀx + ½λᵀEλ + σ(z)  subject to D x + E λ + b = z, where σ stands for the law, is Douglas
// and Rachford's splitting of  0 ∈ (N λ + r) + N_Υ(λ)  (Gabay 1983; Eckstein and Bertsekas 1992). All of its state is
// y = λ − ρ z, in scaled variables:
//
//     λ = law(y)                        the reactions of the law, with z = (λ − y)/ρ             (contact_law.hpp)
//     μ = (1 + ρN)⁻¹(2λ − y − ρ r)      those of the equations of motion, with u = (2λ − y − μ)/ρ  (resolvent.hpp)
//     y ← y + α (μ − λ)                 α: over-relaxation
//
// At a fixed point μ = λ, hence u = z. One vector of state is what the acceleration works on.
#pragma once

#include <cmath>

#include "delassus/sdk/anderson.hpp"
#include "delassus/sdk/monitor.hpp"
#include "penalty_rule.hpp"

namespace delassus::admm {

inline constexpr const char* accelerations[] = {"none", "nesterov", "anderson"};
inline constexpr delassus_option rho_option =
    sdk::real_option("rho", "1", 1e-6, 1e6, "", "penalty at the start, relative to the inverse of diag(N)");
inline constexpr delassus_option over_relaxation_option =
    sdk::real_option("over_relaxation", "1.6", 0.1, 1.99, "", "share of each step taken; 1 is the plain method");
inline constexpr delassus_option adaptive_option = sdk::boolean_option(
    "adaptive_rho", true, "let the penalty follow the iterates, with a new factorisation each time");
inline constexpr delassus_option acceleration_option =
    sdk::choice_option("acceleration", "anderson", accelerations, "extrapolation of the iterates");
inline constexpr delassus_option memory_option =
    sdk::integer_option("memory", "10", 1, 100, "iterations", "differences that anderson keeps");
inline constexpr delassus_option stall_option =
    sdk::integer_option("stall_iterations", "20000", 0, 1e9, "iterations",
                        "give up after this many iterations without an improvement by 1 %; 0: never");

/// System: a ScaledSystem (scaled_system.hpp), or what has its operations for the rows of one process.
template <class System>
class Iteration {
public:
    explicit Iteration(const sdk::OptionValues& options)
        : initial_penalty_(options.real("rho")),
          over_relaxation_(options.real("over_relaxation")),
          adaptive_(options.boolean("adaptive_rho")),
          memory_(static_cast<int>(options.integer("memory"))),
          stall_iterations_(options.integer("stall_iterations")) {
        const std::string acceleration = options.choice("acceleration");
        acceleration_ = acceleration == "none"       ? Acceleration::None
                        : acceleration == "nesterov" ? Acceleration::Nesterov
                                                     : Acceleration::Anderson;
    }

    [[nodiscard]] double initial_penalty() const { return initial_penalty_; }

    /// Leaves the best iterate in x (n) and lambda (m), where the start is. system must be loaded.
    [[nodiscard]] sdk::Outcome solve(System& system, const sdk::Request& request, sdk::MutableVectorView x,
                                     sdk::MutableVectorView lambda) {
        Run run{system, request, sdk::Monitor(request, stall_iterations_)};
        if (request.resume()) {
            run.monitor.go_on(lambda, best_error_);
            iterate(run, true);
        } else {
            // Not the penalty that the last solve ended with: a run that goes on from a checkpoint takes the same path.
            system.set_penalty(initial_penalty_);
            if (!check(run, start(run, x, lambda))) iterate(run, false);
        }
        system.end_iterations();
        best_error_ = run.monitor.best_residual();
        lambda = run.monitor.best();
        x = system.definite() ? system.velocity(lambda) : best_x_;
        return run.monitor.outcome();
    }

private:
    enum class Acceleration { None, Nesterov, Anderson };
    struct Run {
        System& system;
        const sdk::Request& request;
        sdk::Monitor monitor;
        std::int64_t iteration = 0;
    };

    // The given reactions, or none, put onto Υ; the state ŷ that a solution with these λ̂ and û would have. Their error.
    double start(const Run& run, const sdk::MutableVectorView& x, const sdk::MutableVectorView& lambda) {
        const System& system = run.system;
        for (sdk::Vector* v : {&z_, &w_, &mu_, &u_, &step_, &plain_, &last_}) v->resize(lambda.size());
        x_.setZero(x.size());
        lambda_.setZero(lambda.size());
        if (run.request.warm_start() && system.everywhere(x.allFinite() && lambda.allFinite())) {
            x_ = x;
            lambda_ = lambda.cwiseQuotient(system.scale());
            system.project(lambda_, lambda_);
        }
        reactions_ = lambda_.cwiseProduct(system.scale());
        const double error = system.claim(reactions_, x_);
        best_x_ = x_;
        y_ = lambda_ - system.penalty() * system.scale().cwiseProduct(system.velocities(reactions_, x_));
        anderson_.reset(y_.size(), memory_);
        penalty_rule_.reset(y_.size());
        forget();
        extrapolated_ = false;
        accepted_ = 0.0;
        iteration_ = 0;
        return error;
    }

    // judged: the state was judged by the run that stopped.
    void iterate(Run& run, bool judged) {
        System& system = run.system;
        for (;; judged = false) {
            if (!judged) {
                ++run.iteration;
                ++iteration_;
                system.next_iteration();
                system.project(y_, lambda_);
                w_ = 2.0 * lambda_ - y_;
                system.resolve(w_, mu_, u_);
                if (judge(run)) return;
            }

            // ‖μ − λ‖ is the combined residual of Goldstein et al. (2014): under a convex law no plain step grows it.
            step_ = over_relaxation_ * (mu_ - lambda_);
            const double length = system.norm(step_);
            if (extrapolated_ && !(length <= accepted_)) {
                y_ = plain_;
                forget();
                extrapolated_ = false;
                continue;
            }
            accepted_ = length;
            plain_ = y_ + step_;
            extrapolated_ = !(adaptive_ && change_penalty(run)) && extrapolate(system);
        }
    }

    // μ̂ and û obey the equations of motion up to rounding, so that their natural error costs no product with N; a claim
    // rests on velocities computed anew. True: stop.
    bool judge(Run& run) {
        const System& system = run.system;
        reactions_ = mu_.cwiseProduct(system.scale());
        velocities_ = u_.cwiseQuotient(system.scale());
        if (!system.definite()) x_ = system.x();
        double error = system.natural(reactions_, velocities_);
        if (error <= sdk::Monitor::aim * run.request.tolerance()) error = system.claim(reactions_, x_);
        if (!system.definite() && error < run.monitor.best_residual()) best_x_ = x_;
        return check(run, error);
    }
    bool check(Run& run, double error) {
        return run.monitor.check(run.iteration, run.system.definite() ? nullptr : x_.data(), reactions_, error);
    }

    // Asks the rule; on a change ŷ moves so that λ̂ and ẑ of the point after the step stay.
    bool change_penalty(Run& run) {
        System& system = run.system;
        const double before = system.penalty();
        z_ = (lambda_ - y_) / before;
        const double after = penalty_rule_.next(lambda_, z_, run.monitor.best_residual(), iteration_, before,
                                                [&system](const sdk::Vector& v) { return system.norm(v); });
        if (after == before) return false;
        system.set_penalty(after);
        system.project(plain_, lambda_);
        y_ = lambda_ + (after / before) * (plain_ - lambda_);
        forget();
        return true;
    }

    // ŷ ← the next point. True: it is extrapolated, and has to prove itself.
    bool extrapolate(const System& system) {
        switch (acceleration_) {
            case Acceleration::None:
                break;
            case Acceleration::Anderson:
                anderson_.push(step_, plain_, {}, system.sum());
                if (anderson_.extrapolate(y_)) return true;
                break;
            case Acceleration::Nesterov: {
                const double next = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * theta_ * theta_));
                const double momentum = has_last_ ? (theta_ - 1.0) / next : 0.0;
                y_ = plain_ + momentum * (plain_ - last_);
                last_ = plain_;
                has_last_ = true;
                theta_ = next;
                return momentum > 0.0;
            }
        }
        y_ = plain_;
        return false;
    }

    void forget() {
        anderson_.clear();
        theta_ = 1.0;
        has_last_ = false;
        last_.setZero();
    }

    double initial_penalty_, over_relaxation_;
    bool adaptive_;
    Acceleration acceleration_;
    int memory_;
    std::int64_t stall_iterations_;

    PenaltyRule penalty_rule_;
    sdk::Anderson anderson_;
    std::int64_t iteration_ = 0;                       // of all runs since the start
    double best_error_ = 0.0;                          // of the iterates since the start
    bool extrapolated_ = false;                        // whether ŷ is, and has to prove itself
    double accepted_ = 0.0;                            // ‖step‖ of the latest point that was not rejected
    double theta_ = 1.0;                               // Nesterov's sequence
    bool has_last_ = false;                            // whether last_ is there to extrapolate from
    sdk::Vector y_, lambda_;                           // the state and its λ̂
    sdk::Vector z_, w_;                                // ẑ; 2λ̂ − ŷ
    sdk::Vector mu_, u_;                               // the equations' μ̂ and û
    sdk::Vector step_, plain_;                         // α(μ̂ − λ̂), and ŷ after it
    sdk::Vector last_;                                 // the plain_ before
    sdk::Vector reactions_, velocities_, x_, best_x_;  // of μ̂, in the problem's units
};

}  // namespace delassus::admm
