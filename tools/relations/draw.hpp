// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "generate/counted_random.hpp"

namespace delassus::relations {

using Point = std::array<double, 3>;

/// A sequence of draws that depends on a seed and a counter alone. Numbers are multiples of 1e-6: what compilers and
/// libraries make of the last digits is not in them, so that every machine draws the same.
class Draw {
public:
    Draw(std::uint64_t seed, std::uint64_t counter) : random_(seed), counter_(counter) {}

    double share() { return random_.share(counter_, place_++); }
    bool chance(double probability) { return share() < probability; }
    int below(int count) { return static_cast<int>(share() * count); }
    /// from ≤ … ≤ to
    int whole(int from, int to) { return from + below(to - from + 1); }
    double uniform(double from, double to) { return rounded(from + (to - from) * share()); }
    template <class T>
    T one_of(std::initializer_list<T> all) {
        return all.begin()[below(static_cast<int>(all.size()))];
    }
    template <class T>
    const T& one_of(const std::vector<T>& all) {
        return all[static_cast<std::size_t>(below(static_cast<int>(all.size())))];
    }
    Point vector(double amplitude) {
        Point point{};
        for (double& entry : point) entry = uniform(-amplitude, amplitude);
        return point;
    }
    /// An axis of the frame, or any direction; of any length.
    Point direction(double share_of_axes = 0.6) {
        if (chance(share_of_axes)) {
            Point axis{};
            axis[static_cast<std::size_t>(below(3))] = one_of<double>({-1.0, 1.0});
            return axis;
        }
        Point point = vector(1.0);
        point[2] += point[2] < 0.0 ? -0.1 : 0.1;
        return point;
    }

    static double rounded(double value) { return std::round(value * 1e6) / 1e6; }

private:
    generating::CountedRandom random_;
    std::uint64_t counter_, place_ = 0;
};

}  // namespace delassus::relations
