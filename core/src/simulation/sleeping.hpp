// SPDX-License-Identifier: BSD-3-Clause
// Bodies and nodes of a system that stand still and are left out of its steps.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "delassus/multibody.hpp"
#include "delassus/scene.hpp"
#include "delassus/step_solver.hpp"

namespace delassus {

class Sleeping : public RestingParts {
public:
    /// system: finished.
    Sleeping(const MultibodySystem& system, const SleepingRule& rule);

    /// Before a step of size h.
    void begin_step(double h);
    /// After it, from before to now: sleepers keep their positions to the bit, and what was quiet for long enough
    /// stops.
    void end_step(const State& before, State& now);

    bool rests(std::span<const std::int32_t> columns, std::uint64_t identity) override;
    void solved(std::span<const std::int32_t> columns, std::uint64_t identity, std::span<double> x) override;

    /// Bodies and nodes that sleep.
    [[nodiscard]] std::int64_t count() const;

    /// What is carried from step to step, for checkpoints; load() takes what save() gave, and throws InputError if it
    /// is of another system.
    [[nodiscard]] std::vector<double> save() const;
    void load(const std::vector<double>& memory);

private:
    /// A body or node that may move.
    struct Unit {
        std::int32_t column, velocities;   ///< its entries of v
        std::int32_t position, positions;  ///< and of q
        double inertia[6] = {};            ///< over the mass: xx, yy, zz, xy, xz, yz, m²
        // Carried from step to step:
        double quiet = 0.0;      ///< s, for how long it was slow
        std::uint64_t rest = 0;  ///< awake, on trial, or the identity of the part that it sleeps in
        // Of this step:
        std::int32_t part = -1;  ///< number of its part; −1: of none that has rows
    };
    /// Visits the units of a part, the one after the other as their columns come.
    template <class Visitor>
    void for_each(std::span<const std::int32_t> columns, Visitor&& visit);
    /// The square of the unit's speed; v: its velocities.
    [[nodiscard]] static double square_of_speed(const Unit& unit, const double* v);

    SleepingRule rule_;
    std::vector<Unit> units_;            // by ascending columns
    std::vector<std::int32_t> unit_of_;  // by column
    double h_ = 0.0;
    std::int32_t parts_ = 0;       // met in this step
    std::vector<char> all_quiet_;  // by part
};

}  // namespace delassus
