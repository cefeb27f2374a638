// SPDX-License-Identifier: BSD-3-Clause
// The statistics of a report, from plain numbers.
#pragma once

#include <optional>
#include <vector>

namespace delassus::bench {

/// Seconds by problem and solver; nothing where the solver did not solve the problem.
using Times = std::vector<std::vector<std::optional<double>>>;

/// Performance profiles (Dolan and Moré, Math. Program. 91, 2002): r_ps = t_ps / min_s t_ps, and
/// ρ_s(τ) = |{p : r_ps ≤ τ}| / |{p}| over the problems that at least one solver solved.
struct Profiles {
    std::size_t problems = 0;                 ///< that at least one solver solved
    std::vector<std::vector<double>> ratios;  ///< by solver, ascending: ρ_s jumps by 1/problems at each
    /// ρ_s(τ).
    [[nodiscard]] double at(std::size_t solver, double ratio) const;
};
/// All rows have the same length. Times below `least` count as that: below it, ratios are those of the clock.
[[nodiscard]] Profiles performance_profiles(const Times& times, double least = 0.0);

/// exp(mean(log(t + shift))) − shift; NaN of nothing.
[[nodiscard]] double shifted_geometric_mean(const std::vector<double>& values, double shift);

/// y = c x^p by least squares in logarithms.
struct PowerFit {
    double exponent = 0.0;
    double standard_error = 0.0;  ///< of the exponent
    double factor = 0.0;          ///< c
};
/// Nothing for fewer than three points, points that are not positive, or equal x.
[[nodiscard]] std::optional<PowerFit> fit_power(const std::vector<double>& x, const std::vector<double>& y);

/// Ratio of two times with what the repeats allow: from least over greatest to greatest over least.
struct Ratio {
    double value = 0.0, low = 0.0, high = 0.0;
    /// Whether the repeats of the two do not overlap.
    [[nodiscard]] bool certain() const { return low > 1.0 || high < 1.0; }
};
/// Of the minima; neither is empty, all positive.
[[nodiscard]] Ratio ratio_of(const std::vector<double>& after, const std::vector<double>& before);

}  // namespace delassus::bench
