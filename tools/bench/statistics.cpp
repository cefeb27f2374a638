// SPDX-License-Identifier: BSD-3-Clause
#include "bench/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace delassus::bench {

double Profiles::at(std::size_t solver, double ratio) const {
    if (problems == 0) return 0.0;
    const auto& own = ratios[solver];
    const auto within = std::upper_bound(own.begin(), own.end(), ratio) - own.begin();
    return static_cast<double>(within) / static_cast<double>(problems);
}

Profiles performance_profiles(const Times& times, double least) {
    Profiles profiles;
    if (!times.empty()) profiles.ratios.resize(times.front().size());
    for (const auto& row : times) {
        double best = std::numeric_limits<double>::infinity();
        for (const auto& time : row)
            if (time) best = std::min(best, std::max(*time, least));
        if (!std::isfinite(best)) continue;
        ++profiles.problems;
        for (std::size_t s = 0; s < row.size(); ++s)
            if (row[s]) profiles.ratios[s].push_back(best > 0.0 ? std::max(*row[s], least) / best : 1.0);
    }
    for (auto& ratios : profiles.ratios) std::sort(ratios.begin(), ratios.end());
    return profiles;
}

double shifted_geometric_mean(const std::vector<double>& values, double shift) {
    if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
    double sum = 0.0;
    for (const double value : values) sum += std::log(value + shift);
    return std::exp(sum / static_cast<double>(values.size())) - shift;
}

// With u = log x, v = log y: p = Σ(u − ū)(v − v̄) / Σ(u − ū)², and its variance is that of the residuals with n − 2
// degrees of freedom over Σ(u − ū)².
std::optional<PowerFit> fit_power(const std::vector<double>& x, const std::vector<double>& y) {
    const std::size_t count = x.size();
    if (count < 3 || y.size() != count) return std::nullopt;
    double mean_u = 0.0, mean_v = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        if (!(x[i] > 0.0) || !(y[i] > 0.0)) return std::nullopt;
        mean_u += std::log(x[i]) / static_cast<double>(count);
        mean_v += std::log(y[i]) / static_cast<double>(count);
    }
    double uu = 0.0, uv = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        const double u = std::log(x[i]) - mean_u;
        uu += u * u;
        uv += u * (std::log(y[i]) - mean_v);
    }
    if (!(uu > 0.0)) return std::nullopt;
    PowerFit fit;
    fit.exponent = uv / uu;
    fit.factor = std::exp(mean_v - fit.exponent * mean_u);
    double residuals = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        const double residual = std::log(y[i]) - mean_v - fit.exponent * (std::log(x[i]) - mean_u);
        residuals += residual * residual;
    }
    fit.standard_error = std::sqrt(residuals / static_cast<double>(count - 2) / uu);
    return fit;
}

Ratio ratio_of(const std::vector<double>& after, const std::vector<double>& before) {
    const auto [least_after, most_after] = std::minmax_element(after.begin(), after.end());
    const auto [least_before, most_before] = std::minmax_element(before.begin(), before.end());
    return {*least_after / *least_before, *least_after / *most_before, *most_after / *least_before};
}

}  // namespace delassus::bench
