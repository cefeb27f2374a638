// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <delassus/export.hpp>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace delassus {

/// What the velocities of the last steps show of the error that a step makes in them (docs/tolerance.md).
class StepError {
public:
    /// Takes the velocities at the beginning of a step.
    DELASSUS_API void note(const std::vector<double>& v);

    /// Absolute values, n, valid until the next call of note() or forget(); zeros until three second differences are
    /// known.
    [[nodiscard]] std::span<const double> known() const { return error_; }

    DELASSUS_API void forget();

    /// How many numbers of each velocity a checkpoint keeps.
    static constexpr std::size_t kept = 4;
    /// These, n each; empty before the first step.
    [[nodiscard]] DELASSUS_API std::array<std::vector<double>, kept> save() const;
    /// Takes what save() gave, all of one size.
    DELASSUS_API void load(std::array<std::vector<double>, kept> memory);

private:
    std::vector<double> before_, change_;
    std::array<std::vector<double>, 3> jumps_;  // the latest first
    std::vector<double> error_;
};

}  // namespace delassus
