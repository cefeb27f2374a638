// SPDX-License-Identifier: BSD-3-Clause
#include "solver/judgement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "delassus/error.hpp"
#include "problem/infeasibility.hpp"

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
double least_natural(const Errors& error) {
    constexpr double unit_roundoff = 0.5 * std::numeric_limits<double>::epsilon();
    const double by_gap = error.rounding > 0.0 ? unit_roundoff * error.gap / error.rounding : 0.0;
    return std::max(error.dual, by_gap);
}

/// The first measure that is not finite; null if all are.
const ErrorMeasure* unknown_measure(const Errors& error) {
    for (const ErrorMeasure& measure : error_measures)
        if (!std::isfinite(error.*measure.value)) return &measure;
    return nullptr;
}

}  // namespace

double worst_of(const Errors& error) {
    if (unknown_measure(error)) return std::numeric_limits<double>::infinity();
    return std::max({error.natural, error.dual, error.balance});
}

void refuse_to_judge(SolveReport& report) {
    report.status = Status::NumericalFailure;
    report.message =
        "the numbers of the problem are too large or too small for double precision: with N = D H⁻¹ Dᵀ + E and r = D "
        "H⁻¹a + b, the diagonal of N or the length of r, squared, is beyond 1e308 or below 1e-308, so that no error "
        "can be measured; other units may help";
}

void check_settings(const SolveSettings& settings) {
    if (!(settings.tolerance > 0.0) || !std::isfinite(settings.tolerance))
        throw InputError(fmt::format("the tolerance is {}; it must be positive", settings.tolerance));
    if (settings.max_iterations < 0)
        throw InputError(fmt::format("the iteration limit is {}; it must not be negative", settings.max_iterations));
    if (!(settings.time_limit > 0.0))
        throw InputError(fmt::format("the time limit is {} s; it must be positive", settings.time_limit));
}

void judge_infeasibility(SolveReport& report, double proven) {
    if (proven >= beyond_all_sizes) return;
    report.status = Status::FalseClaim;
    report.message = fmt::format(
        "{} claimed that there is no solution; its answer proves only that none is smaller than {:.1e} in units of the "
        "data",
        report.solver, proven);
}

void judge(SolveReport& report, bool only_cones, const std::function<RoundingOfBalance()>& rounding_of) {
    const double claimed = claim_slack * report.tolerance;
    const double natural_bound = std::max(claimed, std::min(rounding_slack * report.error.rounding, rounding_limit));
    const double balance_bound = std::max(claimed, balance_floor);
    if (report.status == Status::Solved &&
        !(report.error.natural <= natural_bound && report.error.balance <= balance_bound)) {
        // If only the rounding of x contradicts the claim, the answer is neither a false claim nor a solution.
        // Reactions that cancel one another leave nothing to compare their rounding with: where they are small enough
        // for the natural error to be measured, it says all.
        const RoundingOfBalance rounding = rounding_of();
        const bool natural = report.error.natural <= natural_bound;
        const bool stands = natural && report.error.balance <= rounding_slack * rounding.reactions &&
                            rounding_slack * report.error.rounding <= natural_bound;
        if (!stands && natural && report.error.balance <= rounding_slack * rounding.all) {
            report.status = Status::NumericalFailure;
            report.message = fmt::format(
                "the balance error is {:.2e}, the tolerance {:.2e}: H is so stiff that rounding x to double "
                "precision alone may leave {:.1e}",
                report.error.balance, report.tolerance, rounding.all);
        } else if (!stands) {
            report.status = Status::FalseClaim;
            report.message = fmt::format(
                "{} claimed convergence; the natural error is {:.2e} and the balance error {:.2e}, the "
                "tolerance {:.2e}",
                report.solver, report.error.natural, report.error.balance, report.tolerance);
        }
    }
    if (const ErrorMeasure* unknown = report.status == Status::Solved ? unknown_measure(report.error) : nullptr) {
        report.status = Status::NumericalFailure;
        report.message = fmt::format(
            "{} claimed convergence, but the measure \"{}\" is {}: numbers of the problem or of the solution are too "
            "large for double precision",
            report.solver, unknown->name, report.error.*unknown->value);
    }
    if (const double least = report.status == Status::Solved && only_cones ? least_natural(report.error) : 0.0;
        least > lost_in_rounding * natural_bound) {
        report.status = Status::NumericalFailure;
        report.message = fmt::format(
            "the natural error is measured as {:.2e} but is in truth {:.1e} or more, the tolerance is {:.2e}: next to "
            "such large reactions the velocities that they correct are lost in rounding (masses or lengths of too "
            "different sizes)",
            report.error.natural, least, report.tolerance);
    }
}

}  // namespace delassus
