// SPDX-License-Identifier: BSD-3-Clause
// What a solver leaves of the velocities of bodies that stand still.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/problem.hpp"

namespace delassus {

/// A solve that ends with the natural error ε leaves velocities of some ε of those that bodies would have without
/// reactions; in a wall of bricks up to twenty times that. A body that is slower than that after a step stands still:
///
///     ‖v‖_M ≤ 20 ε ‖M⁻¹ a‖_M,      ε ≤ 10⁻⁸,      a = M v₋ + h f,
///
/// each with the masses, loads and velocities of this body alone, so that a light body beside heavy ones moves on. If
/// what is left stayed, the reactions of one step would leave it once more in the next, and so on until they no longer
/// met the tolerance: a scene at rest would be solved again and again. Where it is 0, the problem of the next step is
/// the same as this one, and its reactions are the answer. The balance of momenta is then off by at most 20 ε.
class DELASSUS_API BodiesAtRest {
public:
    /// Before the solve. bodies: StepRequest::bodies, n, which has to stay, or empty: then all move.
    void begin(const Problem& problem, std::span<const std::int32_t> bodies);
    /// Whether all bodies of an island stand still, with the natural error ε and the velocities x in these columns, or
    /// in all of them if there are none. Several threads may ask at once.
    [[nodiscard]] bool all_stand(std::span<const std::int32_t> columns, std::span<const double> x, double error) const;
    /// After the solve. left: the natural error by column, n. x: the velocities; those of bodies that stand still ← 0.
    void stop(std::span<const double> left, std::span<double> x);

private:
    /// now: ‖v‖²_M of the body.
    [[nodiscard]] bool stands(std::size_t body, double now, double error) const;

    std::span<const std::int32_t> body_;  // of each column
    std::vector<double> mass_;            // the diagonal of H
    std::vector<double> free_;            // ‖M⁻¹ a‖²_M of each body
    std::vector<double> now_, error_;     // of stop(), likewise: ‖v‖²_M, ε
};

}  // namespace delassus
