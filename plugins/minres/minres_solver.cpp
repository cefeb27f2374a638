// SPDX-License-Identifier: BSD-3-Clause
// minres: linear problems (free rows only) by preconditioned MINRES on the symmetric saddle-point matrix.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "delassus/sdk/residual.hpp"
#include "delassus/sdk/solver.hpp"
#include "preconditioner.hpp"

namespace delassus_minres {

using delassus::sdk::MutableVectorView;
using delassus::sdk::NaturalResidual;
using delassus::sdk::OptionValues;
using delassus::sdk::Outcome;
using delassus::sdk::Request;
using delassus::sdk::SparseRowsView;
using delassus::sdk::status_of;

namespace {

constexpr const char* kSchurChoices[] = {"auto", "diagonal", "blocks", "incomplete_cholesky", "identity"};

constexpr delassus_option kOptions[] = {
    delassus::sdk::choice_option("schur", "auto", kSchurChoices,
                                 "preconditioner of the rows; auto: incomplete_cholesky, or blocks where N is dense"),
    delassus::sdk::integer_option("stall_window", "20000", 10, 1e9, "iterations",
                                  "the solve ends as stalled after this many iterations without an improvement by 1 %"),
    delassus::sdk::integer_option("restarts", "50", 0, 1e6, "",
                                  "largest number of restarts from the true residual, after rounding has spoilt it"),
};

Schur schur_choice(const OptionValues& options) {
    const std::string name = options.choice("schur");
    return static_cast<Schur>(std::find(std::begin(kSchurChoices), std::end(kSchurChoices), name) -
                              std::begin(kSchurChoices));
}

/// n entries of x and m of −λ (or of their right-hand sides): the symmetric form K {x; −λ} = {a; −b}.
struct Pair {
    Vector x, y;

    Pair(Eigen::Index n, Eigen::Index m) : x(Vector::Zero(n)), y(Vector::Zero(m)) {}
    [[nodiscard]] double dot(const Pair& other) const { return x.dot(other.x) + y.dot(other.y); }
    void add(double factor, const Pair& other) {
        x += factor * other.x;
        y += factor * other.y;
    }
    void scale(double factor) {
        x *= factor;
        y *= factor;
    }
};

/// K v, K = [H Dᵀ; D −E].
void multiply(const ProblemView& problem, const Pair& v, Pair& result) {
    result.x.noalias() = problem.H * v.x;
    result.x.noalias() += problem.D.transpose() * v.y;
    result.y.noalias() = problem.D * v.x;
    if (problem.E.nonZeros() > 0) result.y.noalias() -= problem.E * v.y;
}

/// {a; −b} − K v with sums in long double: on x86 11 bits more, so that a restart sees a residual with correct digits.
Pair true_residual(const ProblemView& problem, const Pair& v) {
    std::vector<long double> momentum(problem.a.data(), problem.a.data() + problem.n);
    Pair result(problem.n, problem.m);
    for (Eigen::Index i = 0; i < problem.n; ++i)
        for (SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry)
            momentum[static_cast<std::size_t>(i)] -= static_cast<long double>(entry.value()) * v.x[entry.col()];
    for (Eigen::Index i = 0; i < problem.m; ++i) {
        long double velocity = problem.b[i];
        const long double impulse = v.y[i];
        for (SparseRowsView::InnerIterator entry(problem.D, i); entry; ++entry) {
            velocity += static_cast<long double>(entry.value()) * v.x[entry.col()];
            momentum[static_cast<std::size_t>(entry.col())] -= entry.value() * impulse;
        }
        for (SparseRowsView::InnerIterator entry(problem.E, i); entry; ++entry)
            velocity -= static_cast<long double>(entry.value()) * v.y[entry.col()];
        result.y[i] = -static_cast<double>(velocity);
    }
    for (Eigen::Index i = 0; i < problem.n; ++i)
        result.x[i] = static_cast<double>(momentum[static_cast<std::size_t>(i)]);
    return result;
}

/// ‖residual‖ / max(‖Hx‖, ‖Dᵀλ‖, ‖a‖), absolute if those are zero.
double balance(const ProblemView& problem, const Pair& v, const Pair& residual) {
    if (problem.n == 0) return 0.0;
    const double reference =
        std::max({(problem.H * v.x).norm(), (problem.D.transpose() * v.y).norm(), problem.a.norm()});
    return reference > 0.0 ? residual.x.norm() / reference : residual.x.norm();
}

// Below the tolerance, so that rounding in the host's own measurement does not turn a true claim into a false one.
constexpr double kAim = 0.9;
// The host accepts any balance below this.
constexpr double kFloor = 1e-12;
// ‖K y‖ ≤ this · ‖y‖ counts as zero, in norms where K has the size 1.
constexpr double kNull = 1e-9;
// A contradiction is looked for after kFirstLook iterations without a smaller residual and after each multiple of
// kLookPeriod. The first look is early, since further steps along a null space only add rounding.
constexpr std::int64_t kFirstLook = 2, kLookPeriod = 25;

std::string formatted(const char* format, double value) {
    char text[160];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

}  // namespace

class MinresSolver : public delassus::sdk::Solver {
public:
    explicit MinresSolver(const OptionValues& options)
        : preconditioner_(schur_choice(options)),
          stall_window_(options.integer("stall_window")),
          restarts_(options.integer("restarts")) {}

    void analyze(const ProblemView& problem) override { preconditioner_.analyze(problem); }
    void factorize(const ProblemView& problem) override { preconditioner_.factorize(problem); }
    [[nodiscard]] std::int64_t analyses() const override { return preconditioner_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return preconditioner_.factorizations(); }

    Outcome solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                  MutableVectorView lambda) override {
        Run run{problem, request, natural_residual(problem), Pair(problem.n, problem.m), lambda};
        if (request.warm_start()) {
            run.iterate.x = x;
            run.iterate.y = -lambda;
        } else if (request.max_iterations() > 0 && preconditioner_.exact_mass()) {
            run.iterate.x = problem.a;  // x = H⁻¹ a: the balance holds from the start
            preconditioner_.apply_mass(run.iterate.x);
        }
        run.best = run.iterate;
        const auto status = iterate(run);
        x = run.best.x;
        lambda = -run.best.y;
        Outcome outcome;
        outcome.status = status;
        outcome.iterations = run.iterations;
        outcome.residual = run.best_natural;
        if (status == DELASSUS_INFEASIBLE)
            outcome.message = "the rows contradict one another: MINRES ended at the least-squares residual, natural " +
                              formatted("%.3g; ", outcome.residual);
        else if (status == DELASSUS_STALLED)
            outcome.message = "no further progress below natural " + formatted("%.2g", run.best_natural) +
                              formatted(", balance %.2g", run.best_balance) +
                              formatted(" after %.0f restarts; ", static_cast<double>(run.restarts));
        outcome.message += "preconditioner of the rows: " + preconditioner_.description();
        return outcome;
    }

private:
    struct Run {
        const ProblemView& problem;
        const Request& request;
        NaturalResidual natural;
        Pair iterate;   // x, −λ
        Vector lambda;  // λ of the iterate, for progress
        Pair best{0, 0};
        double best_natural = std::numeric_limits<double>::infinity();
        double best_balance = std::numeric_limits<double>::infinity();
        std::int64_t iterations = 0, restarts = 0;
    };

    NaturalResidual natural_residual(const ProblemView& problem) const {
        Vector r = problem.a;
        preconditioner_.apply_mass(r);
        r = problem.D * r + problem.b;
        return {problem, preconditioner_.diagonal(), r};
    }

    Pair preconditioned(const Pair& v) const {
        Pair z = v;
        preconditioner_.apply_mass(z.x);
        preconditioner_.apply_schur(z.y);
        return z;
    }

    static bool met(const Request& request, double natural, double balance) {
        return natural <= kAim * request.tolerance() && balance <= kAim * std::max(request.tolerance(), kFloor);
    }

    static delassus_answer report(Run& run) {
        run.lambda = -run.iterate.y;
        return run.request.progress(run.iterations, run.iterate.x.data(), run.lambda.data());
    }

    /// Restarts MINRES from the true residual until the errors are met, or nothing is gained any more.
    delassus_status iterate(Run& run) const {
        double milestone = std::numeric_limits<double>::infinity();
        int without_gain = 0;
        if (const auto answer = report(run); answer != DELASSUS_CONTINUE) return status_of(answer);
        while (true) {
            Pair residual = true_residual(run.problem, run.iterate);
            const double natural = run.natural.natural(run.lambda, residual.y);
            const double balance = delassus_minres::balance(run.problem, run.iterate, residual);
            if (!std::isfinite(natural) || !std::isfinite(balance)) return DELASSUS_STALLED;
            const double error = std::max(natural, balance);
            if (error < std::max(run.best_natural, run.best_balance)) {
                run.best = run.iterate;
                run.best_natural = natural;
                run.best_balance = balance;
            }
            if (met(run.request, natural, balance)) return DELASSUS_SOLVED;
            if (run.iterations >= run.request.max_iterations()) return DELASSUS_ITERATION_LIMIT;
            if (shows_contradiction(run.problem, residual)) {
                run.best = run.iterate;
                run.best_natural = natural;
                run.best_balance = balance;
                return DELASSUS_INFEASIBLE;
            }
            without_gain = error < 0.5 * milestone ? 0 : without_gain + 1;
            milestone = std::min(milestone, error);
            if (without_gain >= 4 || run.restarts > restarts_) return DELASSUS_STALLED;
            if (error > 10.0 * milestone) {  // rounding has taken over: start again from the true residual
                run.iterate = run.best;
                run.lambda = -run.iterate.y;
                residual = true_residual(run.problem, run.iterate);
            }
            if (const auto status = minimise(run, residual); status != DELASSUS_SOLVED) {
                keep_last(run);
                return status;
            }
            ++run.restarts;
        }
    }

    /// The iterate at which a run was interrupted is returned if its true errors are the smallest.
    static void keep_last(Run& run) {
        const Pair residual = true_residual(run.problem, run.iterate);
        const double natural = run.natural.natural(run.lambda, residual.y);
        const double balance = delassus_minres::balance(run.problem, run.iterate, residual);
        if (!(std::max(natural, balance) < std::max(run.best_natural, run.best_balance))) return;
        run.best = run.iterate;
        run.best_natural = natural;
        run.best_balance = balance;
    }

    /// Whether y = P⁻¹ residual has K y = 0. Then yᵀ{a; −b} = yᵀ residual > 0 whatever the iterate: the equations are
    /// inconsistent, and the residual is the least one in the norm of P⁻¹. Measured with H and diag N, in which K has
    /// the size 1: where N is singular Ŝ⁻¹ magnifies its null space, and so purifies y.
    bool shows_contradiction(const ProblemView& problem, const Pair& residual) const {
        const Pair y = preconditioned(residual);
        const Vector& diagonal = preconditioner_.diagonal();
        const double squared_length = y.x.dot(residual.x) + y.y.cwiseAbs2().dot(diagonal);
        Pair image(problem.n, problem.m);
        multiply(problem, y, image);
        Vector z = image.x;
        preconditioner_.apply_mass(z);
        const Vector weights = (diagonal.array() > 0.0).select(diagonal, 1.0).cwiseInverse();
        const double squared_image = z.dot(image.x) + image.y.cwiseAbs2().dot(weights);
        return residual.dot(y) > 0.0 && squared_image <= kNull * kNull * squared_length;
    }

    /// One run of MINRES (Paige and Saunders 1975; with preconditioner: Elman, Silvester, Wathen 2005, algorithm 4.1)
    /// on K d = residual, adding d to the iterate as it grows. With the Lanczos vectors v_k, ‖v_k‖_P⁻¹ = γ_k, and the
    /// plane rotation (c, s) of step k that leaves η of the right-hand side, the residual itself follows without a
    /// product:
    ///
    ///     r_k = s² r_{k−1} + η c v_{k+1} / γ_{k+1},
    ///
    /// so that the natural error and the balance are watched at each step for O(n + m).
    /// DELASSUS_SOLVED: the recurrence says that all is reached, or can do no more; the caller measures the truth.
    delassus_status minimise(Run& run, Pair residual) const {
        const ProblemView& problem = run.problem;
        const Eigen::Index n = problem.n, m = problem.m;
        Pair v = residual, v_before(n, m), w(n, m), w_before(n, m), q(n, m);
        Pair z = preconditioned(v);
        double gamma = std::sqrt(std::max(0.0, z.dot(v))), gamma_before = 1.0;
        double eta = gamma, c = 1.0, c_before = 1.0, s = 0.0, s_before = 0.0;
        const double start = gamma;
        double milestone = start;
        std::int64_t milestone_iteration = run.iterations;
        if (!(gamma > 0.0) || !std::isfinite(gamma)) return DELASSUS_STALLED;

        while (run.iterations < run.request.max_iterations()) {
            z.scale(1.0 / gamma);
            multiply(problem, z, q);
            const double delta = q.dot(z);
            q.add(-delta / gamma, v);
            q.add(-gamma / gamma_before, v_before);
            std::swap(v_before, v);
            std::swap(v, q);  // v is v_{k+1}; q holds v_{k−1}, to be overwritten
            Pair z_next = preconditioned(v);
            const double gamma_next = std::sqrt(std::max(0.0, z_next.dot(v)));

            const double alpha0 = c * delta - c_before * s * gamma;
            const double alpha1 = std::hypot(alpha0, gamma_next);
            const double alpha2 = s * delta + c_before * c * gamma;
            const double alpha3 = s_before * gamma;
            // K has the size 1 in the preconditioner's norm: a column at rounding level has nothing to give.
            const double size = std::max({1.0, std::abs(delta), gamma});
            if (!(alpha1 > 1e-14 * size) || !std::isfinite(alpha1)) return DELASSUS_SOLVED;
            c_before = c;
            s_before = s;
            c = alpha0 / alpha1;
            s = gamma_next / alpha1;

            // w_{k+1} = (z_k − α₃ w_{k−1} − α₂ w_k) / α₁
            w_before.scale(-alpha3);
            w_before.add(-alpha2, w);
            w_before.add(1.0, z);
            w_before.scale(1.0 / alpha1);
            std::swap(w, w_before);
            run.iterate.add(c * eta, w);
            eta = -s * eta;
            ++run.iterations;

            residual.scale(s * s);
            if (gamma_next > 0.0) residual.add(eta * c / gamma_next, v);
            if (const auto answer = report(run); answer != DELASSUS_CONTINUE) return status_of(answer);

            const double natural = run.natural.natural(run.lambda, residual.y);
            if (natural <= 0.5 * kAim * run.request.tolerance() &&
                met(run.request, natural, 2.0 * balance(problem, run.iterate, residual)))
                return DELASSUS_SOLVED;
            if (!std::isfinite(eta) || std::abs(eta) <= 1e-14 * start || !(gamma_next > 1e-14 * size))
                return DELASSUS_SOLVED;
            if (std::abs(eta) < 0.99 * milestone) {
                milestone = std::abs(eta);
                milestone_iteration = run.iterations;
            } else {
                const std::int64_t waiting = run.iterations - milestone_iteration;
                if ((waiting == kFirstLook || waiting % kLookPeriod == 0) && shows_contradiction(problem, residual))
                    return DELASSUS_SOLVED;
                if (waiting >= stall_window_) return DELASSUS_STALLED;
            }
            z = std::move(z_next);
            gamma_before = gamma;
            gamma = gamma_next;
        }
        return DELASSUS_SOLVED;
    }

    Preconditioner preconditioner_;
    std::int64_t stall_window_, restarts_;
};

}  // namespace delassus_minres

DELASSUS_SOLVER_PLUGIN(delassus_minres::MinresSolver,
                       (delassus::sdk::PluginInfo{
                           .name = "minres",
                           .version = "0.1.0",
                           .description = "preconditioned MINRES on the symmetric saddle-point matrix",
                           .licence = "BSD-3-Clause AND MPL-2.0",
                           .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                                           DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_H_SEMIDEFINITE |
                                           DELASSUS_CAN_H_INDEFINITE | DELASSUS_CAN_REDUCED | DELASSUS_CAN_COMPLIANCE |
                                           DELASSUS_CAN_REDUNDANT | DELASSUS_CAN_WARM_START}),
                       delassus_minres::kOptions)
