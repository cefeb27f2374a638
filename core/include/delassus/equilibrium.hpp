// SPDX-License-Identifier: BSD-3-Clause
// Static equilibrium of a system of a scene, by load stepping, or on the path of equilibria.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
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
/// divided. With the method arc_length the end of the path of equilibria at these loads, with a load step for each of
/// its points. Throws InputError for velocities at the start and motors that move at t = 0, Unsupported for motors with
/// a force limit and for contacts and stops that would act, StepFailure where there is no equilibrium, StepInterrupted
/// where cancelled asks for it.
[[nodiscard]] DELASSUS_API Equilibrium find_equilibrium(SceneSystem& system, const Registry& registry,
                                                        const LoadStepHook& on_step = {},
                                                        const std::function<bool()>& cancelled = {});

// ---- The path ----

/// What a point of a path is.
enum class PathMark {
    None,
    Limit,       ///< the load factor has an extremum: the structure snaps there if the load grows further
    Bifurcation  ///< another path crosses this one, or leaves it
};

/// A point on a path of equilibria.
struct PathPoint {
    double load = 0.0;  ///< the factor of weight and loads
    /// The arc length ds² = ‖dq‖²_M/D² + dload², D the way that the linear answer to the whole loads goes (1); by
    /// chords.
    double arc = 0.0;
    double displacement = 0.0;  ///< the largest of a body's mass centre or a node, m, from the system's start
    double energy = 0.0;        ///< potential energy, J
    std::int32_t negative_eigenvalues = 0;  ///< 0: stable; −1: not known
    std::int64_t newton_iterations = 0;     ///< of the step that led here
    double residual = 0.0;                  ///< largest unbalanced force, N or Nm
    PathMark mark = PathMark::None;
};

/// Where a displacement from the system's start has a value.
struct PathDisplacement {
    BodyIndex body = world_body;  ///< its mass centre; or
    std::int32_t node = -1;
    int axis = 0;        ///< 0, 1, 2: x, y, z, world frame
    double value = 0.0;  ///< m, not 0
};

/// How far a path is followed.
struct PathRule {
    double load = 1.0;                             ///< > 0: the first point with this load factor is its end
    std::optional<PathDisplacement> displacement;  ///< in place of that, the first point with this displacement
    std::int32_t most_points = 1000;               ///< > 0; marked points do not count
};

struct EquilibriumPath {
    std::vector<PathPoint> points;
    Equilibrium end;  ///< the last point; a load step for each point
    bool complete = false;
    std::string ending;  ///< a sentence: why the path is not complete
};

/// Called with each point of a path and the state there.
using PathHook = std::function<void(const PathPoint&, const State&)>;

/// Assembles the system, then follows the path of equilibria on which the loads begin to grow from 0 with its own
/// rule's first step 1/load_steps, past limit points, by arc length (docs/mechanics.md). Throws as find_equilibrium; a
/// path that ends too early is no failure.
[[nodiscard]] DELASSUS_API EquilibriumPath follow_equilibria(SceneSystem& system, const Registry& registry,
                                                             const PathRule& rule = {}, const PathHook& on_point = {},
                                                             const std::function<bool()>& cancelled = {});

}  // namespace delassus
