// SPDX-License-Identifier: BSD-3-Clause
// Prescribed functions of time.
#include <fmt/format.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "delassus/error.hpp"
#include "delassus/multibody.hpp"

namespace delassus {

namespace {

Motion smooth(std::function<double(double)> value, std::function<double(double)> rate,
              std::function<double(double)> acceleration, std::function<double(double)> integral) {
    return {.value = std::move(value),
            .rate = std::move(rate),
            .acceleration = std::move(acceleration),
            .integral = std::move(integral),
            .foreseeable = true};
}

}  // namespace

Motion Motion::constant(double value) {
    Motion motion = smooth([=](double) { return value; }, [](double) { return 0.0; }, [](double) { return 0.0; },
                           [=](double t) { return value * t; });
    motion.is_constant = true;
    return motion;
}

Motion Motion::linear(double start, double slope) {
    return smooth([=](double t) { return start + slope * t; }, [=](double) { return slope; },
                  [](double) { return 0.0; }, [=](double t) { return start * t + 0.5 * slope * t * t; });
}

Motion Motion::sine(double amplitude, double frequency, double phase, double offset) {
    const double omega = 2.0 * std::numbers::pi * frequency;
    Motion motion = smooth([=](double t) { return offset + amplitude * std::sin(omega * t + phase); },
                           [=](double t) { return amplitude * omega * std::cos(omega * t + phase); },
                           [=](double t) { return -amplitude * omega * omega * std::sin(omega * t + phase); },
                           [=](double t) {
                               const double swing = omega == 0.0
                                                        ? std::sin(phase) * t
                                                        : (std::cos(phase) - std::cos(omega * t + phase)) / omega;
                               return offset * t + amplitude * swing;
                           });
    if (amplitude != 0.0 && frequency != 0.0) motion.oscillation_period = 1.0 / std::abs(frequency);
    return motion;
}

namespace {

/// Σ c_k s^k.
double horner(const std::vector<double>& coefficients, double s) {
    double result = 0.0;
    for (auto c = coefficients.rbegin(); c != coefficients.rend(); ++c) result = result * s + *c;
    return result;
}

std::vector<double> derivative(const std::vector<double>& coefficients) {
    std::vector<double> result;
    for (std::size_t k = 1; k < coefficients.size(); ++k) result.push_back(static_cast<double>(k) * coefficients[k]);
    return result;
}

std::vector<double> antiderivative(const std::vector<double>& coefficients) {
    std::vector<double> result = {0.0};
    for (std::size_t k = 0; k < coefficients.size(); ++k)
        result.push_back(coefficients[k] / static_cast<double>(k + 1));
    return result;
}

/// Polynomials in t − times[i] between times[i] and times[i + 1]. Outside, the values at the ends are kept, or
/// everything repeats.
struct Piecewise {
    std::vector<double> times;
    bool periodic = false;
    std::vector<std::vector<double>> value, rate, acceleration, integral;  // coefficients of each piece
    std::vector<double> sums;                                              // ∫ from times[0] to times[i]
    double last = 0.0;                                                     // the value at the end

    Piecewise(std::vector<double> at, std::vector<std::vector<double>> pieces, bool repeats)
        : times(std::move(at)), periodic(repeats), value(std::move(pieces)), sums{0.0} {
        for (std::size_t i = 0; i < value.size(); ++i) {
            rate.push_back(derivative(value[i]));
            acceleration.push_back(derivative(rate[i]));
            integral.push_back(antiderivative(value[i]));
            sums.push_back(sums.back() + horner(integral[i], times[i + 1] - times[i]));
        }
        last = horner(value.back(), times.back() - times[times.size() - 2]);
    }

    [[nodiscard]] double period() const { return times.back() - times.front(); }
    [[nodiscard]] double periods_before(double t) const {
        return periodic ? std::floor((t - times.front()) / period()) : 0.0;
    }
    /// The piece at a time from times.front() to times.back().
    [[nodiscard]] std::size_t piece(double t) const {
        const auto after = std::upper_bound(times.begin(), times.end(), t);
        const auto index = static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - times.begin() - 1, 0));
        return std::min(index, value.size() - 1);
    }
    [[nodiscard]] double of(const std::vector<std::vector<double>>& pieces, double t) const {
        t -= periods_before(t) * period();
        const std::size_t i = piece(t);
        return horner(pieces[i], t - times[i]);
    }
    [[nodiscard]] bool outside(double t) const { return !periodic && (t < times.front() || t >= times.back()); }
    [[nodiscard]] double value_at(double t) const {
        if (!outside(t)) return of(value, t);
        return t < times.front() ? value.front().front() : last;
    }
    [[nodiscard]] double from_start(double t) const {
        if (outside(t))
            return t < times.front() ? value.front().front() * (t - times.front())
                                     : sums.back() + last * (t - times.back());
        const double periods = periods_before(t);
        t -= periods * period();
        const std::size_t i = piece(t);
        return periods * sums.back() + sums[i] + horner(integral[i], t - times[i]);
    }
};

Motion motion_of(Piecewise given) {
    const auto pieces = std::make_shared<const Piecewise>(std::move(given));
    const double start = pieces->from_start(0.0);
    Motion result = smooth([=](double t) { return pieces->value_at(t); },
                           [=](double t) { return pieces->outside(t) ? 0.0 : pieces->of(pieces->rate, t); },
                           [=](double t) { return pieces->outside(t) ? 0.0 : pieces->of(pieces->acceleration, t); },
                           [=](double t) { return pieces->from_start(t) - start; });
    result.corners = pieces->times;
    if (pieces->periodic) result.period = pieces->period();
    return result;
}

// A cubic spline has the slopes m_i at which its second derivative is continuous: with h_i = t_{i+1} − t_i and
// d_i = (y_{i+1} − y_i)/h_i
//
//     m_{i−1}/h_{i−1} + 2 m_i (1/h_{i−1} + 1/h_i) + m_{i+1}/h_i = 3 (d_{i−1}/h_{i−1} + d_i/h_i)
//
// (de Boor, A Practical Guide to Splines, 1978, ch. IV). Where the ends are kept, the slopes there are 0, and the
// motion has a continuous rate; one that repeats has these equations at its ends as well.
std::vector<double> slopes_of_spline(const std::vector<double>& t, const std::vector<double>& y, bool periodic) {
    const std::size_t pieces = t.size() - 1;
    const std::size_t first = periodic ? 0 : 1, count = periodic ? pieces : pieces - 1;
    std::vector<double> slopes(t.size(), 0.0);
    if (count == 0) return slopes;
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(count));
    for (std::size_t piece = 0; piece < pieces; ++piece) {
        const double h = t[piece + 1] - t[piece], slope = (y[piece + 1] - y[piece]) / h;
        std::array<std::ptrdiff_t, 2> ends{};  // among the unknowns
        for (std::size_t k = 0; k < 2; ++k) {
            ends[k] = static_cast<std::ptrdiff_t>(piece + k) - static_cast<std::ptrdiff_t>(first);
            if (periodic) ends[k] %= static_cast<std::ptrdiff_t>(count);
        }
        for (std::size_t k = 0; k < 2; ++k) {
            if (ends[k] < 0 || ends[k] >= static_cast<std::ptrdiff_t>(count)) continue;
            right[ends[k]] += 3.0 * slope / h;
            entries.emplace_back(static_cast<int>(ends[k]), static_cast<int>(ends[k]), 2.0 / h);
            if (const auto other = ends[1 - k]; other >= 0 && other < static_cast<std::ptrdiff_t>(count))
                entries.emplace_back(static_cast<int>(ends[k]), static_cast<int>(other), 1.0 / h);
        }
    }
    Eigen::SparseMatrix<double> matrix(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(count));
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Eigen::VectorXd solved = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right);
    for (std::size_t i = 0; i < count; ++i) slopes[first + i] = solved[static_cast<Eigen::Index>(i)];
    if (periodic) slopes.back() = slopes.front();
    return slopes;
}

bool all_finite(const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

}  // namespace

Motion Motion::table(const std::vector<double>& times, const std::vector<double>& values, Interpolation interpolation,
                     bool periodic) {
    if (times.size() < 2 || times.size() != values.size())
        throw InputError(fmt::format("a table has {} times and {} values; it needs two or more of each, and as many",
                                     times.size(), values.size()));
    if (!all_finite(times) || !all_finite(values)) throw InputError("the numbers of a table must be finite");
    if (const auto at = std::adjacent_find(times.begin(), times.end(), std::greater_equal<>()); at != times.end())
        throw InputError(
            fmt::format("the times of a table must ascend, and {} is followed by {}", *at, *std::next(at)));
    if (periodic && values.front() != values.back())
        throw InputError(fmt::format("a periodic table must end with the value that it begins with, {}, not with {}",
                                     values.front(), values.back()));
    std::vector<std::vector<double>> pieces;
    const bool cubic = interpolation == Interpolation::Cubic;
    const std::vector<double> slopes = cubic ? slopes_of_spline(times, values, periodic) : std::vector<double>{};
    for (std::size_t i = 0; i + 1 < times.size(); ++i) {
        const double h = times[i + 1] - times[i], slope = (values[i + 1] - values[i]) / h;
        if (!cubic) {
            pieces.push_back({values[i], slope});
            continue;
        }
        const double before = slopes[i], after = slopes[i + 1];
        pieces.push_back(
            {values[i], before, (3.0 * slope - 2.0 * before - after) / h, (before + after - 2.0 * slope) / (h * h)});
    }
    return motion_of({times, std::move(pieces), periodic});
}

Motion Motion::polynomial(const std::vector<double>& coefficients) {
    if (coefficients.empty() || !all_finite(coefficients))
        throw InputError("a polynomial needs one finite coefficient or more");
    const auto rate = derivative(coefficients), acceleration = derivative(rate),
               integral = antiderivative(coefficients);
    return smooth([coefficients](double t) { return horner(coefficients, t); },
                  [rate](double t) { return horner(rate, t); },
                  [acceleration](double t) { return horner(acceleration, t); },
                  [integral](double t) { return horner(integral, t); });
}

// With s from 0 to 1: 3 s² − 2 s³ has rate 0 at both ends, 10 s³ − 15 s⁴ + 6 s⁵ also the second derivative 0.
Motion Motion::ramp(double from, double to, double start, double duration, int smoothness) {
    if (!all_finite({from, to, start, duration}) || !(duration > 0.0))
        throw InputError(
            fmt::format("a ramp lasts {} s; its duration must be positive, and its numbers finite", duration));
    if (smoothness != 1 && smoothness != 2)
        throw InputError(fmt::format("the smoothness of a ramp is {}; it must be 1 or 2", smoothness));
    std::vector<double> shape = smoothness == 1 ? std::vector<double>{0.0, 0.0, 3.0, -2.0}
                                                : std::vector<double>{0.0, 0.0, 0.0, 10.0, -15.0, 6.0};
    double power = 1.0;
    for (double& c : shape) {
        c *= (to - from) / power;
        power *= duration;
    }
    shape[0] = from;
    Motion motion = motion_of({{start, start + duration}, {shape}, false});
    motion.ramp_duration = duration;
    return motion;
}

}  // namespace delassus
