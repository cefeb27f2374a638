// SPDX-License-Identifier: BSD-3-Clause
// What a scene needs and what it does without, each with its reason.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/registry.hpp"
#include "delassus/scene.hpp"

namespace delassus {

/// A thing that is kept or left out, and why.
struct PlanLine {
    std::string what;
    std::string reason;
};

/// What is kept of a system and what is left out.
struct SystemPlan {
    std::string name;
    std::int32_t velocities = 0;   ///< n
    std::int32_t constraints = 0;  ///< rows of joints and motors, kept or not
    std::int32_t parts = 0;        ///< of the first step's problem that go to a solver, each apart from the others
    std::vector<PlanLine> kept, left_out;
    /// Plugins: those that the first step loaded, then those that later contacts will load.
    std::vector<std::string> solvers;
    /// Plugins that the run loads only in a step where those do not reach the tolerance.
    std::vector<std::string> later_solvers;
    /// Files that the run maps beyond libdelassus, its own parts and the C++ library; -o adds delassus_trajectory.so.
    std::vector<std::string> libraries;
};

/// Takes one step of a copy of each system's state to see its problems; the scene stays as it is. Throws as Simulation
/// does, and Unsupported if the scene may need a solver that is not installed or cannot take it.
[[nodiscard]] DELASSUS_API std::vector<SystemPlan> make_plan(Scene& scene, const Registry& registry);

}  // namespace delassus
