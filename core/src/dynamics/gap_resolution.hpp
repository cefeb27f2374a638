// SPDX-License-Identifier: BSD-3-Clause
// How near to 0 a gap counts as closed (internal).
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "delassus/dynamical_system.hpp"

namespace delassus {

/// What a solver leaves of the velocities adds up in the gaps, and divided by h it would come back as a motion, so that
/// nothing came to rest. A natural error ε is one of velocities relative to those without reactions, which at rest are
/// h g: a step leaves some ε g h² in the gaps, and in a wall of bricks ten to twenty times that. So the resolution is
/// 20 ε g h², where ε is the largest natural error, up to 10⁻², that any step has left in the bodies of the contact,
/// and at least what the system gives (docs/tolerance.md).
class GapResolution {
public:
    explicit GapResolution(const DynamicalSystem& system)
        : least_(system.gap_resolution()), free_fall_(system.free_fall()) {}

    /// m, of gaps that no step has left.
    [[nodiscard]] double least() const { return least_; }
    /// m, of a contact whose row has these columns, in a step of size h (s).
    [[nodiscard]] double of(std::span<const std::int32_t> columns, double h) const {
        constexpr double share = 20.0, most = 1e-2;
        if (left_.empty() || free_fall_ == 0.0) return least_;
        double error = 0.0;
        for (const std::int32_t column : columns) error = std::max(error, left_[static_cast<std::size_t>(column)]);
        return std::max(least_, share * std::min(error, most) * free_fall_ * h * h);
    }

    /// Takes what a step left (StepAnswer::left, n).
    void note(std::span<const double> left) {
        left_.resize(left.size());
        for (std::size_t i = 0; i < left.size(); ++i) left_[i] = std::max(left_[i], left[i]);
    }
    void forget() { left_.clear(); }

    /// The largest errors so far, n or empty, for checkpoints.
    [[nodiscard]] const std::vector<double>& left() const { return left_; }
    void load(std::vector<double> left) { left_ = std::move(left); }

private:
    double least_, free_fall_;
    std::vector<double> left_;
};

}  // namespace delassus
