// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>

namespace delassus::generating {

/// Numbers that depend on the seed alone: the standard fixes the engine's output but not that of its distributions.
class Random {
public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}

    /// Uniform in [0, 1): the upper 53 bits, the width of a double's significand.
    double share() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }

    /// Uniform in [−amplitude, amplitude).
    double symmetric(double amplitude) { return amplitude * (2.0 * share() - 1.0); }

    Eigen::Vector3d vector(double amplitude) {
        // One statement a component: the order of evaluation of arguments is not fixed.
        Eigen::Vector3d result;
        for (int i = 0; i < 3; ++i) result[i] = symmetric(amplitude);
        return result;
    }

private:
    std::mt19937_64 engine_;
};

}  // namespace delassus::generating
