// SPDX-License-Identifier: BSD-3-Clause
// The error measures by which every solver is judged (docs/errors.md). They are computed here, from the problem and
// (x, λ) alone.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "delassus/export.hpp"
#include "delassus/needs.hpp"

namespace delassus {

/// All are zero at a solution and dimensionless; u = D x + E λ + b, with the De Saxcé term under the Coulomb law.
struct Errors {
    double natural = 0.0;  ///< ‖S⁻¹(λ − P_Υ(λ − S²u))‖ / ‖S r‖
    double siconos = 0.0;  ///< ‖λ − P_Υ(λ − u)‖ / max(‖r‖, ‖λ‖, ‖u‖): depends on units, for comparison only
    double balance = 0.0;  ///< ‖H x − Dᵀλ − a‖ / max(‖H x‖, ‖Dᵀλ‖, ‖a‖)
    double cone = 0.0;     ///< ‖S⁻¹(λ − P_Υ λ)‖ / ‖S r‖
    double dual = 0.0;     ///< ‖S(u − P_Υ* u)‖ / ‖S r‖
    double gap = 0.0;      ///< |⟨λ, u⟩| / ‖S r‖²; for a box the gap of its variational inequality
    /// No error: what rounding alone may contribute to natural at this (x, λ), so that a smaller one says nothing.
    /// ε ‖S (|D||x| + |E||λ| + |b|) + S⁻¹|λ|‖ / ‖S r‖ with the unit roundoff ε = 1.1e-16
    double rounding = 0.0;
};

/// A row of the table of what Errors holds. Reports, files, terminal and pages follow it, and docs/errors.md is tested
/// against it: a new measure is a member, its computation in ErrorMeter, and a row.
struct ErrorMeasure {
    std::string_view name;     ///< the key in reports and files
    std::string_view unit;     ///< "1": dimensionless
    std::string_view title;    ///< what it says, in a few words
    std::string_view formula;  ///< in the symbols of docs/errors.md
    std::string_view note;     ///< one line for docs/errors.md; may be empty
    double Errors::*value;
    bool is_error = true;  ///< false for what stands beside the errors
    bool brief = false;    ///< shown where there is room for few
};

inline constexpr std::array<ErrorMeasure, 7> error_measures = {{
    {"natural", "1", "natural error", "‖S⁻¹(λ − P_Υ(λ − S²u))‖ / ‖S r‖",
     "the measure that `tolerance` means; absolute if r = 0", &Errors::natural, true, true},
    {"balance", "1", "momentum balance", "‖Hx − Dᵀλ − a‖ / max(‖Hx‖, ‖Dᵀλ‖, ‖a‖)", "", &Errors::balance, true, true},
    {"cone", "1", "reactions beyond the friction cones", "‖S⁻¹(λ − P_Υ λ)‖ / ‖S r‖", "distance of λ to Υ",
     &Errors::cone},
    {"dual", "1", "penetration and sliding against the cones", "‖S(u − P_Υ* u)‖ / ‖S r‖",
     "distance of u to Υ*; for a box, to the dual of its recession cone", &Errors::dual},
    {"gap", "1", "energy that contacts give or take", "|⟨λ, u⟩| / ‖S r‖²",
     "for a box, the gap of its variational inequality", &Errors::gap},
    {"siconos", "1", "the measure of Siconos", "‖λ − P_Υ(λ − u)‖ / max(‖r‖, ‖λ‖, ‖u‖)",
     "depends on units: for comparison with published tables only", &Errors::siconos},
    {"rounding", "1", "what rounding leaves of the natural error", "ε ‖S (|D||x| + |E||λ| + |b|) + S⁻¹|λ|‖ / ‖S r‖", "",
     &Errors::rounding, false},
}};

/// Measures solutions of one problem, which must outlive it (moves of the problem are fine as long as the meter is
/// not used meanwhile). One thread at a time.
///
/// S and r need H⁻¹. Where H is singular or indefinite, so that N does not exist, |diag H|⁻¹ stands in for it, with the
/// mean of the others for a zero entry; for an unsymmetric H they are exact, by LU.
class ErrorMeter {
public:
    DELASSUS_API explicit ErrorMeter(const PreparedProblem& problem);
    DELASSUS_API ~ErrorMeter();
    ErrorMeter(const ErrorMeter&) = delete;
    ErrorMeter& operator=(const ErrorMeter&) = delete;

    /// x: n, lambda: m, finite. Throws InputError on wrong sizes.
    [[nodiscard]] DELASSUS_API Errors measure(std::span<const double> x, std::span<const double> lambda) const;

    /// The natural error alone. x may be null where H is definite or n = 0: H⁻¹(a + Dᵀλ) is used then; elsewhere the
    /// answer is NaN without x.
    [[nodiscard]] DELASSUS_API double natural(const double* x, const double* lambda) const;

    /// ‖x − reference‖_H / ‖reference‖_H; both n. Zero if n = 0. Where the reference is at rest (below 1e-8 of the
    /// velocities without reactions, H⁻¹a, in the same norm), relative to those.
    [[nodiscard]] DELASSUS_API double velocity(std::span<const double> x, std::span<const double> reference) const;

    /// ‖S r‖, what natural errors are relative to: with it they are errors of velocity in the norm of the masses. 1
    /// where r = 0. NaN where double precision does not hold N, the squares of S, or ‖S r‖²: no error can be measured.
    [[nodiscard]] DELASSUS_API double reference() const;

    /// ‖S D v‖ for velocities v (n): how large they are for the rows, in the norm of the masses that the rows feel.
    [[nodiscard]] DELASSUS_API double norm_in_rows(std::span<const double> v) const;

    /// x ← H⁻¹(a + Dᵀλ), n. lambda: m, or empty for none. Throws InputError where H is not definite.
    DELASSUS_API void velocity_of(std::span<const double> lambda, std::vector<double>& x) const;

    /// How often measure() was called.
    [[nodiscard]] DELASSUS_API std::int64_t measurements() const;

private:
    friend class PreparedProblem;
    /// The problem has new values in the same places. Whether all values of D and b are finite; false too if they are
    /// so large that r or N are not.
    bool renew();

    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace delassus
