// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <delassus/export.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace delassus {

/// What the velocities of the last steps show of the error that a step makes in them, apart from what the solver left
/// in them (docs/tolerance.md).
class DELASSUS_API VelocityError {
public:
    /// Of a method of this order, 1 or 2, whose steps are of one size.
    explicit VelocityError(int order);

    /// Takes the velocities at the beginning of a step, and what the solve left that they are from: for each velocity,
    /// in the norm of the masses, the error of its island (StepAnswer::left_in_masses), or nothing where none was.
    void note(const std::vector<double>& v, std::span<const double> left);

    /// Absolute values, n, valid until the next call of note() or forget(); zeros until enough steps are known.
    [[nodiscard]] std::span<const double> known() const { return error_; }
    /// What solves left in the difference that known() is made of, n, for each velocity in the norm of the masses of
    /// its island.
    [[nodiscard]] std::span<const double> of_solver() const { return noise_; }

    void forget();

    /// How many numbers of each velocity a checkpoint keeps.
    [[nodiscard]] std::size_t kept() const { return differences_.size() + jumps_.size() + left_.size(); }
    /// These, n each; empty before the first step.
    [[nodiscard]] std::vector<std::vector<double>> save() const;
    /// Takes what save() gave, all of one size.
    void load(std::span<std::vector<double>> memory);

private:
    double constant_;                   ///< of the error, in front of the difference
    std::vector<double> coefficients_;  ///< of the difference, squared
    std::vector<double> before_;
    std::vector<std::vector<double>> differences_;  ///< of the last velocities, by their order from 1 on
    std::vector<std::vector<double>> jumps_;        ///< the errors, the latest first
    std::vector<std::vector<double>> left_;         ///< likewise
    std::vector<double> error_, noise_;
};

}  // namespace delassus
