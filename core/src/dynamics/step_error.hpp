// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <delassus/export.hpp>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace delassus {

/// What the velocities of the last steps show of the error that a step makes in them, apart from what the solver left
/// in them (docs/tolerance.md).
class StepError {
public:
    /// Takes the velocities at the beginning of a step, and what the solve left that they are from: for each velocity,
    /// in the norm of the masses, the error of its island (StepSolver::left_in_masses), or nothing where none was.
    DELASSUS_API void note(const std::vector<double>& v, std::span<const double> left);

    /// Absolute values, n, valid until the next call of note() or forget(); zeros until three second differences are
    /// known.
    [[nodiscard]] std::span<const double> known() const { return error_; }
    /// What solves left in a second difference, n, for each velocity in the norm of the masses of its island.
    [[nodiscard]] std::span<const double> of_solver() const { return noise_; }

    DELASSUS_API void forget();

    /// How many numbers of each velocity a checkpoint keeps.
    static constexpr std::size_t kept = 7;
    /// These, n each; empty before the first step.
    [[nodiscard]] DELASSUS_API std::array<std::vector<double>, kept> save() const;
    /// Takes what save() gave, all of one size.
    DELASSUS_API void load(std::array<std::vector<double>, kept> memory);

private:
    std::vector<double> before_, change_;
    std::array<std::vector<double>, 3> jumps_;  // the latest first
    std::array<std::vector<double>, 3> left_;   // likewise
    std::vector<double> error_, noise_;
};

}  // namespace delassus
