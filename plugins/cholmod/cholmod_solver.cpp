// SPDX-License-Identifier: BSD-3-Clause
// cholmod: linear problems (free rows only) by sparse Cholesky factors, proximal shift and iterative refinement.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "delassus/sdk/residual.hpp"
#include "delassus/sdk/solver.hpp"
#include "fgmres.hpp"

namespace delassus_cholmod {

using delassus::sdk::MutableVectorView;
using delassus::sdk::NaturalResidual;
using delassus::sdk::OptionValues;
using delassus::sdk::Outcome;
using delassus::sdk::ProblemView;
using delassus::sdk::Request;
using delassus::sdk::status_of;

namespace {

constexpr const char* kForms[] = {"auto", "schur", "quasi_definite"};
constexpr const char* kOrderings[] = {"auto", "amd", "metis", "best"};
constexpr const char* kMethods[] = {"auto", "simplicial", "supernodal"};

constexpr delassus_option kOptions[] = {
    delassus::sdk::choice_option("form", "auto", kForms,
                                 "what is factored: H and its Schur complement, or the quasi-definite saddle point"),
    delassus::sdk::choice_option("ordering", "auto", kOrderings,
                                 "fill-reducing order; auto: AMD, and METIS where AMD leaves much fill; best: try all"),
    delassus::sdk::choice_option("factorization", "auto", kMethods,
                                 "LLᵀ by rows or by dense blocks; auto: by the work per entry"),
    delassus::sdk::real_option("shift", "0", 0.0, 1e-4, "",
                               "proximal shift relative to diag(N); 0: 1e-12 (schur) or 1e-9 (quasi_definite)"),
    delassus::sdk::integer_option("refinements", "20", 0, 1000, "", "largest number of refinements of a solve"),
    delassus::sdk::integer_option("krylov_steps", "30", 1, 200, "",
                                  "largest number of accelerated proximal steps in a refinement"),
};

template <std::size_t Count>
int position(const char* const (&choices)[Count], const std::string& value) {
    return static_cast<int>(std::find(std::begin(choices), std::end(choices), value) - std::begin(choices));
}

FactorSettings settings_from(const OptionValues& options) {
    return {static_cast<Ordering>(position(kOrderings, options.choice("ordering"))),
            static_cast<Method>(position(kMethods, options.choice("factorization"))),
            static_cast<Form>(position(kForms, options.choice("form"))), options.real("shift")};
}

// Refinement goes on below the tolerance while it pays: a direct solver is used for its last digits.
constexpr double kAim = 1e-13;
// The host accepts any balance below this.
constexpr double kFloor = 1e-12;

std::string formatted(const char* format, double value) {
    char text[200];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

}  // namespace

class CholmodSolver : public delassus::sdk::Solver {
public:
    explicit CholmodSolver(const OptionValues& options)
        : factor_(settings_from(options)),
          refinements_(options.integer("refinements")),
          krylov_steps_(static_cast<int>(options.integer("krylov_steps"))) {}

    void analyze(const ProblemView&) override { factor_.analyze(); }
    void factorize(const ProblemView& problem) override { factor_.factorize(problem); }
    [[nodiscard]] std::int64_t analyses() const override { return factor_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return factor_.factorizations(); }

    Outcome solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                  MutableVectorView lambda) override {
        if (!request.warm_start()) {
            x.setZero();
            lambda.setZero();
        }
        Refinement state{problem, request, NaturalResidual(problem, factor_.diagonal(), factor_.free_velocity(problem)),
                         x, lambda};
        Outcome outcome;
        outcome.status = refine(state, Pair(problem.n, problem.m));
        outcome.residual = state.natural;
        outcome.message = factor_.description();
        if (outcome.status == DELASSUS_STALLED) {
            if (const auto contradiction = find_contradiction(state)) {
                outcome.status = answer_least_squares(state, *contradiction);
                outcome.residual = state.residual.natural(lambda, contradiction->lambda);
                outcome.message = "the rows contradict one another: no x and λ bring the scaled residual below " +
                                  formatted("%.3g (natural error) ", outcome.residual) +
                                  "and this is the least-squares answer; " + outcome.message;
            } else {
                outcome.message = "refinement stopped at natural " + formatted("%.2g", state.natural) + ", balance " +
                                  formatted("%.2g", state.balance) + "; " + outcome.message;
            }
        }
        outcome.iterations = state.iterations;
        x = state.x;
        lambda = state.lambda;
        return outcome;
    }

private:
    struct Refinement {
        const ProblemView& problem;
        const Request& request;
        NaturalResidual residual;
        Vector x, lambda;  // the best iterate so far
        double natural = 0.0, balance = 0.0;
        std::int64_t iterations = 0;
    };

    /// Repeats x, λ ← x, λ + A⁻¹(residual − offset) until nothing is gained; leaves the best iterate. offset: the part
    /// of the residual (problem's units) that is to stay.
    delassus_status refine(Refinement& state, const Pair& offset) const {
        const ScaledSystem& system = factor_.system();
        const double limit = 0.99 * std::max(state.request.tolerance(), kFloor);
        const double natural_limit = 0.99 * state.request.tolerance();
        Vector x = state.x, lambda = state.lambda;
        double best = std::numeric_limits<double>::infinity();
        int without_gain = 0;
        const auto met = [&] { return state.natural <= natural_limit && state.balance <= limit; };
        for (std::int64_t refinement = 0;; ++refinement) {
            Pair left = residual(state.problem, x, lambda);
            left.add(-1.0, offset);
            const double natural = state.residual.natural(lambda, left.lambda);
            const double balance = delassus_cholmod::balance(state.problem, x, lambda, left.x);
            const double error = std::max(natural, balance);
            if (!std::isfinite(error)) break;
            without_gain = error < 0.5 * best ? 0 : without_gain + 1;
            if (error < best) {
                best = error;
                state.natural = natural;
                state.balance = balance;
                state.x = x;
                state.lambda = lambda;
            }
            if (const auto answer = state.request.progress(state.iterations, x.data(), lambda.data());
                answer != DELASSUS_CONTINUE)
                return status_of(answer);
            if (best <= kAim || without_gain >= (met() ? 1 : 3) || refinement >= refinements_) break;
            if (state.iterations >= state.request.max_iterations())
                return met() ? DELASSUS_SOLVED : DELASSUS_ITERATION_LIMIT;

            left.x.array() *= system.R.array();
            left.lambda.array() *= system.S.array();
            delassus_answer answer = DELASSUS_CONTINUE;
            int steps = 0;
            const int steps_left = static_cast<int>(
                std::min<std::int64_t>(krylov_steps_, state.request.max_iterations() - state.iterations));
            const auto before_step = [&] {
                if (steps > 0)
                    answer = state.request.progress(state.iterations + steps, state.x.data(), state.lambda.data());
                return answer == DELASSUS_CONTINUE;
            };
            const Pair correction = fgmres(factor_, left, 1e-6, steps_left, before_step, steps);
            state.iterations += steps;
            if (answer != DELASSUS_CONTINUE) return status_of(answer);
            x.array() += system.R.array() * correction.x.array();
            lambda.array() += system.S.array() * correction.lambda.array();
        }
        return met() ? DELASSUS_SOLVED : DELASSUS_STALLED;
    }

    /// The part of the residual that no x and λ can remove, in the problem's units; nothing if there is no proof of
    /// one.
    ///
    /// A = [H̃ −D̃ᵀ; D̃ Ẽ] is monotone, so that A and Aᵀ have the same null space: H̃ y_x = 0, D̃ y_x = 0, D̃ᵀ y_λ = 0,
    /// Ẽ y_λ = 0. The part y of the right-hand side in that space stays for every x and λ: it is the least-squares
    /// residual. T = (A + diag(ρ, δ))⁻¹ diag(ρ, δ) keeps this part and shrinks every other, so powers of T isolate it
    /// up to an error ε/δ in its size. Applying the same to the remainder corrects that error. The proof is that ‖A y‖
    /// is then at rounding level. (A direction that is merely ill-conditioned has ‖A y‖ = √σ, many powers of ten
    /// larger.)
    [[nodiscard]] std::optional<Pair> find_contradiction(const Refinement& state) const {
        const ProblemView& problem = state.problem;
        const ScaledSystem& system = factor_.system();
        Pair left(problem.n, problem.m), y(problem.n, problem.m);
        if (factor_.definite()) {
            left.lambda = -system.S.cwiseProduct(factor_.free_velocity(problem));
        } else {
            left.x = system.R.cwiseProduct(problem.a);
            left.lambda = -system.S.cwiseProduct(problem.b);
        }
        for (int correction = 0; correction < 8; ++correction) {
            Pair part = left;
            for (int power = 0; power < 8; ++power) {
                part.x *= factor_.primal_shift();
                part.lambda *= factor_.dual_shift();
                part = factor_.solve(part);
                if (factor_.definite()) part.x.setZero();
            }
            y.add(1.0, part);
            left.add(-1.0, part);
            if (!(part.norm() > 1e-15 * y.norm())) break;
        }
        const double length = y.norm();
        if (!std::isfinite(length) || !(multiply(system, y).norm() <= 1e-8 * length)) return std::nullopt;
        Pair offset = y;
        offset.x.array() /= system.R.array();
        offset.lambda.array() /= system.S.array();
        const double tolerance = state.request.tolerance();
        const double force = problem.n > 0 ? problem.a.norm() : 0.0;
        if (state.residual.natural(state.lambda, offset.lambda) <= tolerance && offset.x.norm() <= tolerance * force)
            return std::nullopt;
        return offset;
    }

    /// The answer to the equations without their contradictory part: the least-squares answer to all of them.
    delassus_status answer_least_squares(Refinement& state, const Pair& contradiction) const {
        state.x.setZero();
        state.lambda.setZero();
        const auto status = refine(state, contradiction);
        return status == DELASSUS_TIME_LIMIT || status == DELASSUS_CANCELLED ? status : DELASSUS_INFEASIBLE;
    }

    ShiftedFactor factor_;
    std::int64_t refinements_;
    int krylov_steps_;
};

}  // namespace delassus_cholmod

DELASSUS_SOLVER_PLUGIN(
    delassus_cholmod::CholmodSolver,
    (delassus::sdk::PluginInfo{
        .name = "cholmod",
        .version = "0.1.0",
        .description = "sparse Cholesky of H and of the Schur complement, or of a quasi-definite form, with refinement",
        .licence = "BSD-3-Clause AND LGPL-2.1-or-later AND GPL-2.0-or-later",
        .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS | DELASSUS_CAN_H_DEFINITE |
                        DELASSUS_CAN_H_SEMIDEFINITE | DELASSUS_CAN_REDUCED | DELASSUS_CAN_COMPLIANCE |
                        DELASSUS_CAN_REDUNDANT | DELASSUS_CAN_WARM_START}),
    delassus_cholmod::kOptions)
