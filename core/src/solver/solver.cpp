// SPDX-License-Identifier: BSD-3-Clause
// One solve: what is checked before it, and the judgement afterwards.
#include "delassus/solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "problem/cone_kinds.hpp"
#include "solver/solver_implementation.hpp"
#include "support/finite.hpp"

namespace delassus {

namespace {

/// Claims are compared with the tolerance up to this factor: the host and the solver round differently.
constexpr double claim_slack = 1.001;
/// A balance error at this level is rounding, whatever tolerance was asked.
constexpr double balance_floor = 1e-12;
/// A claim also counts as true at the rounding floor: up to so many times Errors::rounding (sums of some hundred
/// products), and up to this natural error at most.
constexpr double rounding_slack = 32.0;
constexpr double rounding_limit = 1e-10;
/// Rounding has swallowed a claim if natural is below its own lower bound by this factor.
constexpr double lost_in_rounding = 10.0;

/// A lower bound of natural from quantities that do not add velocities to reactions. Let R = z − P(z − F) be the
/// natural map for z = S⁻¹λ and F = S u. Then P(z − F) − (z − F) = F − R lies in Υ* and is orthogonal to P(z − F) = z −
/// R (Moreau), so that
///
///     ‖R‖ ≥ dist(F, Υ*)      and      ‖R‖ ‖z + F‖ + ‖R‖² ≥ |⟨z, F⟩|
///
/// are Errors::dual and Errors::gap. In floating point, reactions that are large enough swallow a velocity to the last
/// digit; then R is 0 for any u. rounding/ε is at least ‖z‖/‖S r‖. A set that is not a cone (a box) has no Υ*, and its
/// gap means something else.
double least_natural(const Problem& problem, const Errors& error) {
    for (const Cone& cone : problem.cones)
        if (!operations_of(cone).is_cone) return 0.0;
    constexpr double unit_roundoff = 0.5 * std::numeric_limits<double>::epsilon();
    const double by_gap = error.rounding > 0.0 ? unit_roundoff * error.gap / error.rounding : 0.0;
    return std::max(error.dual, by_gap);
}

/// What rounding alone may contribute to Errors::balance at this (x, λ): ε ‖|H||x| + |D|ᵀ|λ| + |a|‖ over the divisor of
/// the balance, with the unit roundoff ε. With a stiff H, ‖|H||x|‖ is far above ‖Hx‖, and x rounded to double cannot
/// balance better. `reactions` is the part of |D|ᵀ|λ|: what reactions that cancel one another leave.
struct RoundingOfBalance {
    double all = 0.0, reactions = 0.0;
};

RoundingOfBalance rounding_of_balance(const Problem& problem, const Solution& solution) {
    const auto n = static_cast<std::size_t>(problem.n());
    std::vector<double> magnitude(n), momentum(n, 0.0), impulse(n, 0.0), reactions(n, 0.0);
    for (std::size_t i = 0; i < n; ++i) magnitude[i] = std::abs(problem.a[i]);
    problem.H.multiply_add(1.0, solution.x.data(), momentum.data());
    problem.D.transpose_multiply_add(1.0, solution.lambda.data(), impulse.data());
    SparseMatrix absolute = problem.H;
    std::vector<double> sizes = solution.x;
    const auto make_absolute = [](std::vector<double>& values) {
        for (double& value : values) value = std::abs(value);
    };
    make_absolute(absolute.value);
    make_absolute(sizes);
    absolute.multiply_add(1.0, sizes.data(), magnitude.data());
    absolute = problem.D;
    sizes = solution.lambda;
    make_absolute(absolute.value);
    make_absolute(sizes);
    absolute.transpose_multiply_add(1.0, sizes.data(), reactions.data());
    for (std::size_t i = 0; i < n; ++i) magnitude[i] += reactions[i];
    const auto norm = [](const std::vector<double>& values) {
        double sum = 0.0;
        for (const double value : values) sum += value * value;
        return std::sqrt(sum);
    };
    const double divisor = std::max({norm(momentum), norm(impulse), norm(problem.a)});
    if (!(divisor > 0.0)) return {};
    const double unit = 0.5 * std::numeric_limits<double>::epsilon() / divisor;
    return {unit * norm(magnitude), unit * norm(reactions)};
}

void check_settings(const SolveSettings& settings) {
    if (!(settings.tolerance > 0.0) || !std::isfinite(settings.tolerance))
        throw InputError(fmt::format("the tolerance is {}; it must be positive", settings.tolerance));
    if (settings.max_iterations < 0)
        throw InputError(fmt::format("the iteration limit is {}; it must not be negative", settings.max_iterations));
    if (!(settings.time_limit > 0.0))
        throw InputError(fmt::format("the time limit is {} s; it must be positive", settings.time_limit));
}

}  // namespace

std::string_view name_of(Status status) {
    switch (status) {
        case Status::Solved:
            return "solved";
        case Status::IterationLimit:
            return "iteration_limit";
        case Status::TimeLimit:
            return "time_limit";
        case Status::Stalled:
            return "stalled";
        case Status::Infeasible:
            return "infeasible";
        case Status::NumericalFailure:
            return "numerical_failure";
        case Status::Cancelled:
            return "cancelled";
        case Status::Error:
            return "error";
        case Status::FalseClaim:
            return "false_claim";
    }
    return "error";
}

std::string quoted_name(const PreparedProblem& problem) {
    const std::string& name = problem.problem().name;
    return name.empty() ? "the problem" : fmt::format("\"{}\"", name);
}

std::uint64_t needs_of(const PreparedProblem& problem, const SolveSettings& settings) {
    std::uint64_t needs = problem.needs();
    if (settings.warm_start) needs |= DELASSUS_CAN_WARM_START;
    if (process_count() > 1) needs |= DELASSUS_CAN_DISTRIBUTED;
    return needs;
}

std::string who_can(const Registry& registry, std::uint64_t needs) {
    const auto capable = registry.capable(needs);
    return capable.empty() ? ". No installed solver can" : fmt::format(". Can: {}", fmt::join(capable, ", "));
}

Solver::Solver(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}
Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;
Solver& Solver::operator=(Solver&&) noexcept = default;

const PluginInfo& Solver::info() const {
    return implementation_->info();
}

std::string Solver::refusal(const PreparedProblem& problem, const SolveSettings& settings) const {
    return implementation_->refusal(problem, settings);
}

SolveReport Solver::solve(const PreparedProblem& problem, Solution& solution, const SolveSettings& settings) {
    check_settings(settings);
    if (const std::string sentence = refusal(problem, settings); !sentence.empty()) throw Unsupported(sentence);

    const auto n = static_cast<std::size_t>(problem.problem().n());
    const auto m = static_cast<std::size_t>(problem.problem().m());
    if (settings.warm_start) {
        if (solution.x.size() != n || solution.lambda.size() != m)
            throw InputError(fmt::format("the warm start has {} and {} entries; the problem has n = {} and m = {}",
                                         solution.x.size(), solution.lambda.size(), n, m));
        if (!all_finite(solution.x) || !all_finite(solution.lambda))
            throw InputError("the warm start holds a value that is not finite");
    } else {
        solution.x.assign(n, 0.0);
        solution.lambda.assign(m, 0.0);
    }

    SolveReport report;
    report.problem = problem.problem().name;
    report.solver = info().name;
    report.version = info().version;
    report.options = implementation_->options();
    report.law = problem.problem().law;
    report.tolerance = settings.tolerance;
    const std::optional<Errors> measured = implementation_->run(problem, solution, settings, report);

    if (!measured && (!all_finite(solution.x) || !all_finite(solution.lambda))) {
        report.status = Status::NumericalFailure;
        report.message =
            fmt::format("{} returned values that are not finite; they were replaced by zeros", info().name);
        solution.x.assign(n, 0.0);
        solution.lambda.assign(m, 0.0);
    }
    report.error = measured ? *measured : problem.meter().measure(solution.x, solution.lambda);
    const double claimed = claim_slack * settings.tolerance;
    const double natural_bound = std::max(claimed, std::min(rounding_slack * report.error.rounding, rounding_limit));
    const double balance_bound = std::max(claimed, balance_floor);
    if (report.status == Status::Solved &&
        !(report.error.natural <= natural_bound && report.error.balance <= balance_bound)) {
        // If only the rounding of x contradicts the claim, the answer is neither a false claim nor a solution.
        // Reactions that cancel one another leave nothing to compare their rounding with: where they are small enough
        // for the natural error to be measured, it says all.
        const RoundingOfBalance rounding =
            n > 0 ? rounding_of_balance(problem.problem(), solution) : RoundingOfBalance();
        const bool natural = report.error.natural <= natural_bound;
        const bool stands = natural && report.error.balance <= rounding_slack * rounding.reactions &&
                            rounding_slack * report.error.rounding <= natural_bound;
        if (!stands && natural && report.error.balance <= rounding_slack * rounding.all) {
            report.status = Status::NumericalFailure;
            report.message = fmt::format(
                "the balance error is {:.2e}, the tolerance {:.2e}: H is so stiff that rounding x to double "
                "precision alone may leave {:.1e}",
                report.error.balance, settings.tolerance, rounding.all);
        } else if (!stands) {
            report.status = Status::FalseClaim;
            report.message = fmt::format(
                "{} claimed convergence; the natural error is {:.2e} and the balance error {:.2e}, the "
                "tolerance {:.2e}",
                info().name, report.error.natural, report.error.balance, settings.tolerance);
        }
    }
    if (const double least = report.status == Status::Solved ? least_natural(problem.problem(), report.error) : 0.0;
        least > lost_in_rounding * natural_bound) {
        report.status = Status::NumericalFailure;
        report.message = fmt::format(
            "the natural error is measured as {:.2e} but is in truth {:.1e} or more, the tolerance is {:.2e}: next to "
            "such large reactions the velocities that they correct are lost in rounding (masses or lengths of too "
            "different sizes)",
            report.error.natural, least, settings.tolerance);
    }
    if (settings.record_curve && !report.curve.empty()) report.curve.back().natural = report.error.natural;
    return report;
}

}  // namespace delassus
