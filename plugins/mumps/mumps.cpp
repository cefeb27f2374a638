// SPDX-License-Identifier: BSD-3-Clause
// The plugin: a sparse direct solver for linear problems, with refinement on the saddle-point system itself. README.md
// has the method.
#include <cmath>
#include <cstdio>

#include "delassus/sdk/saddle_point.hpp"
#include "delassus/sdk/solver.hpp"
#include "factorization.hpp"

namespace delassus::mumps {

using namespace delassus::sdk;

namespace {

constexpr const char* orderings[] = {"automatic", "amd", "amf", "qamd", "scotch", "metis", "pord"};
constexpr const char* analyses_of_error[] = {"none", "backward", "full"};

constexpr const char* redundancies[] = {"automatic", "null_pivots", "shift"};

constexpr delassus_option options[] = {
    choice_option("ordering", "automatic", orderings, "fill-reducing ordering of the analysis"),
    real_option("pivot_threshold", "0.01", 0.0, 0.5, "", "relative threshold of numerical pivoting; larger is safer"),
    real_option("null_pivot_threshold", "1e-14", 0.0, 1e-3, "",
                "a pivot of the scaled matrix below it marks a redundant row"),
    choice_option(
        "redundant_rows", "automatic", redundancies,
        "the way that is tried first, before the other one; null_pivots: rows are found while factoring; shift: a "
        "shifted matrix and more refinement, faster for many dependent rows; automatic: shift if m > n > 0"),
    integer_option("memory_relaxation", "30", 0, 10000, "%", "working memory above the estimate; grows by itself"),
    integer_option("refinement_steps", "2", 0, 100, "", "iterative refinement inside MUMPS at every solve"),
    choice_option("error_analysis", "backward", analyses_of_error,
                  "MUMPS' error analysis, reported in the message; full adds condition numbers"),
};

Settings settings_of(const OptionValues& values) {
    Settings settings;
    const std::string ordering = values.choice("ordering");
    settings.ordering = ordering == "amd"      ? 0
                        : ordering == "amf"    ? 2
                        : ordering == "scotch" ? 3
                        : ordering == "pord"   ? 4
                        : ordering == "metis"  ? 5
                        : ordering == "qamd"   ? 6
                                               : 7;
    settings.pivot_threshold = values.real("pivot_threshold");
    settings.null_pivot = values.real("null_pivot_threshold");
    settings.memory_relaxation = static_cast<int>(values.integer("memory_relaxation"));
    settings.refinement_steps = static_cast<int>(values.integer("refinement_steps"));
    const std::string analysis = values.choice("error_analysis");
    settings.error_analysis = analysis == "none" ? 0 : analysis == "full" ? 1 : 2;
    return settings;
}

// σ of the proximal refinement, relative to the scaled matrix, whose entries are of order one.
constexpr double proximal_shift = 1e-9;

std::string scientific(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1e", value);
    return text;
}

}  // namespace

class MumpsSolver : public Solver {
public:
    explicit MumpsSolver(const OptionValues& values)
        : factors_(settings_of(values)), redundant_rows_(values.choice("redundant_rows")) {}

    void analyze(const ProblemView& problem) override {
        error_.analyze(problem);
        if (problem.n + problem.m > 0) factors_.analyze(problem, saddle_point_scaling(problem));
    }

    void factorize(const ProblemView& problem) override {
        error_.factorize(problem);
        C_ = saddle_point_scaling(problem);
        const bool more_rows = problem.m > problem.n && problem.n > 0;
        shift_ = redundant_rows_ == "shift" || (redundant_rows_ == "automatic" && more_rows) ? proximal_shift : 0.0;
        null_pivots_ = 0;
        if (problem.n + problem.m == 0) return;
        factors_.factorize(problem, C_, shift_);
        null_pivots_ = factors_.null_pivots();
    }

    Outcome solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                  MutableVectorView lambda) override;

    [[nodiscard]] std::int64_t analyses() const override { return factors_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return factors_.factorizations(); }

private:
    // z ← z + C (C K C)⁻¹ C r in the problem's units; z = {x; −λ}.
    [[nodiscard]] Vector corrected(const Vector& z, const Vector& residual) {
        Vector step = C_.cwiseProduct(residual);
        factors_.solve(step);
        return z + C_.cwiseProduct(step);
    }
    [[nodiscard]] SaddlePointError::Value measure(const ProblemView& problem, const Vector& z, Vector& residual) {
        lambda_ = -z.tail(problem.m);
        return error_.measure(problem, z.head(problem.n), lambda_, &residual);
    }
    [[nodiscard]] bool is_inconsistent(const ProblemView& problem, const Vector& z, const Vector& residual);
    [[nodiscard]] std::string remarks() const;

    Factorization factors_;
    SaddlePointError error_;
    Vector C_, lambda_;
    std::string redundant_rows_;
    double shift_ = 0.0;  // of the factors that are held
    int null_pivots_ = 0;
};

// Is there a solution at all? K z = f has none exactly if some w with Kᵀ w = 0 has wᵀ f ≠ 0 (Fredholm). Then the
// residual of every z has the part wᵀ f / ‖w‖. Repeating
//
//     w ← σ J (K + σ J)⁻¹ w,   J = diag(I, −I)
//
// on the residual isolates such a w. A fixed point w = σ J v has (K + σ J) v = σ J v, so K v = 0. J K is monotone for a
// semidefinite H, so every other component decays by σ/(σ + its eigenvalue). w counts as a certificate only if
// Kᵀ v vanishes to rounding and |vᵀ f| is far above what that rounding can do. All quantities are scaled.
bool MumpsSolver::is_inconsistent(const ProblemView& problem, const Vector& z, const Vector& residual) {
    const auto n = problem.n, m = problem.m;
    Vector v = C_.cwiseProduct(residual);
    v.tail(m) = -v.tail(m);
    if (!(v.norm() > 0.0)) return false;
    v.normalize();
    for (int round = 0; round < 6; ++round) {
        Vector w = v;
        w.tail(m) = -w.tail(m);
        factors_.solve(w);
        if (!w.allFinite() || !(w.norm() > 0.0)) return false;
        v = w.normalized();
    }
    const Vector unscaled = C_.cwiseProduct(v);
    Vector image;
    apply_saddle_point_transposed(problem, unscaled, image);
    const double leak = C_.cwiseProduct(image).norm();
    Vector f(n + m);
    f << problem.a, -problem.b;
    const double certificate = std::abs(unscaled.dot(f));
    const double size = z.cwiseQuotient(C_).norm() + C_.cwiseProduct(f).norm();
    return leak <= 1e-10 && certificate > 100.0 * (leak + 1e-15) * size;
}

std::string MumpsSolver::remarks() const {
    std::string text;
    if (null_pivots_ > 0) {
        text = null_pivots_ == 1 ? "1 null pivot: a redundant row"
                                 : std::to_string(null_pivots_) + " null pivots: redundant rows";
    }
    const auto& analysis = factors_.error_analysis();
    if (analysis.known) {
        if (!text.empty()) text += "; ";
        text += "backward errors " + scientific(analysis.backward_1) + ", " + scientific(analysis.backward_2);
        if (analysis.condition_1 > 0.0)
            text += ", condition numbers " + scientific(analysis.condition_1) + ", " +
                    scientific(analysis.condition_2) + ", forward error <= " + scientific(analysis.forward);
    }
    return text;
}

Outcome MumpsSolver::solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                           MutableVectorView lambda) {
    const auto n = problem.n, m = problem.m;
    const auto& communicator = factors_.communicator();
    // Refinement goes on to here even if less is asked for: it is cheap, and stops by itself at the rounding level.
    constexpr double goal = 1e-10;
    // A refinement step that gains less than this factor is the last one with the present factors.
    constexpr double worthwhile = 0.5;
    constexpr int proximal_steps = 60;

    error_.begin(problem);
    Outcome outcome;
    Vector z = Vector::Zero(n + m), residual, best_residual;
    if (request.warm_start()) z << x, -lambda;
    auto value = measure(problem, z, best_residual);
    const auto keep = [&] {
        x = z.head(n);
        lambda = -z.tail(m);
        outcome.residual = value.natural;
    };
    const auto finish = [&](delassus_status status, const std::string& message) {
        keep();
        outcome.status = status;
        outcome.message = remarks();
        if (!message.empty()) outcome.message = message + (outcome.message.empty() ? "" : "; " + outcome.message);
        return outcome;
    };
    const auto solved = [&] { return communicator.agree(error_.meets(value, request.tolerance()) ? 0 : 1) == 0; };
    const auto answer = [&] {
        keep();
        return communicator.progress(request, outcome.iterations, x.data(), lambda.data());
    };

    constexpr const char* contradiction = "the constraint rows contradict one another: no x fulfils all of them";
    const auto inconsistent = [&] {  // needs shifted factors
        return communicator.agree(is_inconsistent(problem, z, best_residual) ? 1 : 0) != 0;
    };

    if (const auto stop = answer(); stop != DELASSUS_CONTINUE) return finish(status_of(stop), "");
    if (n + m == 0 || request.max_iterations() == 0)
        return finish(solved() ? DELASSUS_SOLVED : DELASSUS_ITERATION_LIMIT, "");
    bool second_factors = false;
    const double target = std::min(goal, 0.1 * request.tolerance());
    int steps = 0;
    while (true) {
        const Vector trial = corrected(z, best_residual);
        const auto trial_value = trial.allFinite() ? measure(problem, trial, residual) : SaddlePointError::Value{};
        ++outcome.iterations;
        ++steps;
        const double gain = trial_value.worst() / value.worst();
        // One measure may rise, as long as it stays within the tolerance, while the other falls.
        const bool better = communicator.agree(trial_value.worst() < value.worst() ? 0 : 1) == 0;
        if (better) {
            z = trial;
            value = trial_value;
            best_residual = residual;
        }
        if (const auto stop = answer(); stop != DELASSUS_CONTINUE) return finish(status_of(stop), "");
        const bool done = communicator.agree(value.worst() <= target ? 0 : 1) == 0;
        const bool over = outcome.iterations >= request.max_iterations();
        const bool slow = communicator.agree(!better || gain > (shift_ > 0.0 ? 0.99 : worthwhile) ? 1 : 0) != 0;
        if (done || over || (slow && steps > 1) || (shift_ > 0.0 && steps >= proximal_steps)) {
            if (solved()) return finish(DELASSUS_SOLVED, "");
            if (over) return finish(DELASSUS_ITERATION_LIMIT, "");
            if (second_factors) break;
            if (shift_ > 0.0 && inconsistent()) return finish(DELASSUS_INFEASIBLE, contradiction);
            second_factors = true;
            steps = 0;
            shift_ = shift_ > 0.0 ? 0.0 : proximal_shift;
            factors_.factorize(problem, C_, shift_);
            null_pivots_ = std::max(null_pivots_, factors_.null_pivots());
        }
    }
    if (shift_ > 0.0 && inconsistent()) return finish(DELASSUS_INFEASIBLE, contradiction);
    return finish(DELASSUS_STALLED,
                  "refinement ends at natural " + scientific(value.natural) + ", balance " + scientific(value.balance));
}

constexpr std::uint64_t capabilities =
    DELASSUS_CAN_FREE | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS | DELASSUS_CAN_H_DEFINITE |
    DELASSUS_CAN_H_SEMIDEFINITE | DELASSUS_CAN_H_INDEFINITE | DELASSUS_CAN_H_UNSYMMETRIC | DELASSUS_CAN_REDUCED |
    DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT | DELASSUS_CAN_WARM_START | DELASSUS_CAN_DISTRIBUTED;

}  // namespace delassus::mumps

DELASSUS_SOLVER_PLUGIN(
    delassus::mumps::MumpsSolver,
    (delassus::sdk::PluginInfo{
        .name = "mumps",
        .version = "1.0.0",
        .description = "Sparse direct solver: symmetric indefinite LDLT, or LU; distributed under MPI",
        .licence = "BSD-3-Clause AND CECILL-C",
        .capabilities = delassus::mumps::capabilities,
        .flags = DELASSUS_FLAG_MPI}),
    delassus::mumps::options)
