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
    /// Of a method of this order, 1 or 2.
    explicit VelocityError(int order);

    /// Takes the velocities at the beginning of a step, and what the solve left that they are from: for each velocity,
    /// in the norm of the masses, the error of its island (StepAnswer::left_in_masses), or nothing where none was.
    /// last: the size of the step that has led there. next: of the one that begins.
    void note(const std::vector<double>& v, std::span<const double> left, double last, double next);

    /// Of the step that begins: absolute values, n, valid until the next call of note() or forget(); zeros until enough
    /// steps are known.
    [[nodiscard]] std::span<const double> known() const { return error_; }
    /// What solves left in the difference that known() is made of, n, for each velocity in the norm of the masses of
    /// its island.
    [[nodiscard]] std::span<const double> of_solver() const { return noise_; }

    void forget();

    /// How many numbers of each velocity a checkpoint keeps.
    [[nodiscard]] std::size_t kept() const { return differences_.size() + jumps_.size() - 1 + left_.size(); }
    /// Of the last steps, as many as the order of the differences, the latest first; 0 where there was none.
    [[nodiscard]] std::span<const double> sizes() const { return sizes_; }
    /// These, n each; empty before the first step.
    [[nodiscard]] std::vector<std::vector<double>> save() const;
    /// Takes what save() gave, all of one size, and sizes().
    void load(std::span<std::vector<double>> memory, std::span<const double> sizes);

private:
    double constant_;                               ///< c
    std::vector<double> sizes_;                     ///< of the last steps, the latest first
    std::vector<std::vector<double>> differences_;  ///< divided, of the last velocities, by their order from 0 on
    std::vector<std::vector<double>> jumps_;        ///< |[t₀, …] v| Π, the latest first
    std::vector<std::vector<double>> left_;         ///< likewise
    std::vector<double> error_, noise_;
};

}  // namespace delassus
