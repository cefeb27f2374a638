// SPDX-License-Identifier: BSD-3-Clause
// Static equilibrium of a system of a scene, by load stepping.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/registry.hpp"
#include "delassus/scene.hpp"

namespace delassus {

/// The equilibrium under a part of the loads.
struct LoadStep {
    double load = 0.0;                   ///< the factor of weight and loads
    std::int64_t steps = 0;              ///< of the search (docs/mechanics.md)
    std::int64_t newton_iterations = 0;  ///< of all these steps
    double residual = 0.0;               ///< largest unbalanced force, N or Nm
    double energy = 0.0;                 ///< potential energy of weight, springs and elements, J
};

struct Equilibrium {
    State state;                      ///< at t = 0, at rest
    std::vector<double> multipliers;  ///< reactions of the kept rows of joints; N, Nm
    std::vector<LoadStep> load_steps;
    double largest_force = 0.0;  ///< of f at the start under the whole loads, or of reactions at the end, N or Nm
    /// The smallest ω² of small vibrations, rad²/s²: negative where the equilibrium is unstable. NaN where it is not
    /// known: no freedom, or more than 600 velocities.
    double smallest_eigenvalue = 0.0;
};

/// Called after each load step with the state there.
using LoadStepHook = std::function<void(const LoadStep&, const State&)>;

/// Assembles the system, then raises weight and loads from 0 to their values at t = 0 in system.equilibrium->load_steps
/// steps (its default rule where there is none), each from the equilibrium of the one before. A load step that fails is
/// divided. Throws InputError for velocities at the start and motors that move at t = 0, Unsupported for motors with a
/// force limit and for contacts and stops that would act, StepFailure where there is no equilibrium, StepInterrupted
/// where cancelled asks for it.
[[nodiscard]] DELASSUS_API Equilibrium find_equilibrium(SceneSystem& system, const Registry& registry,
                                                        const LoadStepHook& on_step = {},
                                                        const std::function<bool()>& cancelled = {});

}  // namespace delassus
