// SPDX-License-Identifier: BSD-3-Clause
// Which solver, with which options: what a configuration, a scene and a command line say, and the solver that it makes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "delassus/communicator.hpp"
#include "delassus/export.hpp"
#include "delassus/plugin_info.hpp"
#include "delassus/problem.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"

namespace delassus {

/// The friction law of scenes that name none.
inline constexpr Law law_of_scenes = Law::Coulomb;

/// The chosen solver and its limits. An absent value keeps the default of SolveSettings. An
/// absent law is the problem's own, in scenes law_of_scenes.
struct SolverConfig {
    std::string name;     ///< a plugin's name, "auto", or the path of a shared library; empty if not given
    OptionTexts options;  ///< the plugin's, and "finish" and "finish_at" of the framework (docs/configuration.md)
    std::optional<double> tolerance;
    std::optional<std::int64_t> max_iterations;
    std::optional<double> time_limit;     ///< seconds
    std::optional<std::int64_t> threads;  ///< ≥ 1, at most the processors; absent: all of them, in scenes one
    std::optional<Law> law;
    /// Iterations to be done in each step of a simulation, whatever error they leave: the cheap mode. The error is
    /// measured and reported, and a step that misses no limit but this one counts as solved. Needs a plugin's name.
    std::optional<std::int64_t> sweeps;

    /// The default settings, overridden by what is given here.
    [[nodiscard]] DELASSUS_API SolveSettings settings() const;
};

/// Parses "name" or "name(key=value,key=value)", the form in which command lines, configurations, suites and scenes
/// name a solver. Throws InputError.
[[nodiscard]] DELASSUS_API SolverConfig parse_solver(std::string_view text);

/// Puts the solver of this text in place of the configuration's. The options of the one before mean nothing to another
/// one and go; where it is the same, they stay beside those of the text. Throws InputError.
DELASSUS_API void choose(SolverConfig& config, std::string_view text);

/// What is known of a solver without loading it: of a plugin, or of "auto", whose capabilities are the union of all
/// plugins'. Throws InputError naming the nearest and all names if there is none.
[[nodiscard]] DELASSUS_API PluginInfo solver_info(const Registry& registry, const std::string& name);

/// Throws InputError if there is no such solver, or an option is unknown or outside its domain (those of a library
/// given by its path are checked when it is loaded). Nothing is loaded.
DELASSUS_API void check_solver(const Registry& registry, const SolverConfig& config);

/// Loads the plugin that the configuration names and makes a solver with its options. The registry must outlive the
/// solver.
[[nodiscard]] DELASSUS_API Solver make_solver(const Registry& registry, const SolverConfig& config);
/// The same for problems that these processes share: where it fails on one of them, it throws InputError on all.
/// Collective.
[[nodiscard]] DELASSUS_API Solver make_solver(const Registry& registry, const SolverConfig& config,
                                              const Communicator& run);

}  // namespace delassus
