// SPDX-License-Identifier: BSD-3-Clause
// Scene files (docs/scenes.md): YAML that describes one or several multibody systems, each with its timestepper and its
// solver.
#pragma once

#include <array>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/adaptive_stepping.hpp"
#include "delassus/export.hpp"
#include "delassus/inputs.hpp"
#include "delassus/multibody.hpp"
#include "delassus/solver_config.hpp"

namespace delassus {

/// An item of the scene that the system does without, because it has no effect.
struct LeftOut {
    std::string what;    ///< "joint \"frame\""
    std::string reason;  ///< "both bodies are fixed"
};

/// A contact material with its name.
struct SceneMaterial {
    std::string name;
    ContactMaterial contact;
};

/// A pair of materials with values of its own; indices into SceneSystem::materials.
struct SceneMaterialPair {
    std::int32_t first = 0, second = 0;
    ContactMaterial contact;
};

/// When bodies sleep: parts of a system whose bodies and nodes all were slower than `speed` for as long as `time`, and
/// that stay at rest when let go, are left out of the solver's problems until something about them changes.
struct SleepingRule {
    double speed = 1e-3;  ///< m/s, > 0; of a body √(2T/m), the root mean square of its points' speeds
    double time = 0.5;    ///< s, > 0
};

/// How a static equilibrium is looked for.
enum class EquilibriumMethod {
    LoadSteps,  ///< weight and loads are raised in steps, each with a search downhill
    ArcLength   ///< the path of equilibria is followed, past limit points
};

/// That a run begins in a static equilibrium (delassus/equilibrium.hpp).
struct EquilibriumRule {
    std::int32_t load_steps = 10;  ///< ≥ 1: parts in which weight and loads are raised; of a path, its first step
    double tolerance = 1e-10;      ///< > 0: the last movement of the search, as a share of the whole way
    EquilibriumMethod method = EquilibriumMethod::LoadSteps;
};

/// What a run must not exceed; a step that does is a failure. Infinity: no limit.
struct RunLimits {
    /// Growth of energy that nothing supplies, as a share of what can have moved (docs/running.md).
    double energy_growth = 1.0;
    double drift = std::numeric_limits<double>::infinity();  ///< of bilateral constraints, m or rad
};

/// The unknowns of a system's bodies.
enum class Coordinates {
    Maximal,  ///< six velocities for each body, and rows for every joint
    Joint     ///< those of the joints, where joints make trees (delassus/joint_coordinates.hpp)
};

/// How the steps of a system are divided by their error, where no tolerance chooses them.
enum class StepDivision {
    None,              ///< they are as given
    WhileCheap,        ///< those that err by more than `accuracy` are, at most for a fixed work a step; chosen
    ToAccuracy,        ///< all are, as the scene gives an accuracy; `step` is then how often results are shown
    ToChosenAccuracy,  ///< all are, though it gives none: fixed steps would change its motion
};

/// A system, finished and ready to be simulated, with the settings of the file.
struct SceneSystem {
    std::string name;  ///< "main" in a file without `systems`
    std::unique_ptr<MultibodySystem> system;
    Inputs inputs;  ///< of its loads, motors and actuators

    Coordinates coordinates = Coordinates::Maximal;
    bool coordinates_chosen = false;  ///< the scene names none
    std::string integrator = "euler_implicit_linearized";
    OptionTexts integrator_options;
    std::string method_reason;  ///< why the integrator is this one; empty: the scene names it
    SolverConfig solver;        ///< an empty name: `auto`
    double step = 0.0;          ///< s, > 0; with `control` the first that is tried
    double accuracy = 1e-3;     ///< of positions a second, as a share of the extent of what moves, and rad
    StepDivision division = StepDivision::None;
    [[nodiscard]] bool steps_by_accuracy() const {
        return division == StepDivision::ToAccuracy || division == StepDivision::ToChosenAccuracy;
    }
    std::optional<StepControl> control;          ///< steps follow from a tolerance; none: all are `step` long
    std::optional<SleepingRule> sleeping;        ///< none: every body is awake
    std::optional<EquilibriumRule> equilibrium;  ///< none: it starts as given
    RunLimits limits;                            ///< what a run must not exceed
    double end = 0.0;                            ///< s, ≥ 0: the time at which the simulation ends; it starts at 0
    double planned_end = 0.0;  ///< that of the scene by itself, where `end` was asked for (SceneOverrides::end), s

    // The names that a plan and a report use.
    std::vector<BodyParameters> bodies;  ///< by BodyIndex
    std::vector<NodeParameters> nodes;   ///< by number
    std::vector<ElasticBlock> elastic_blocks;
    std::vector<std::int32_t> node_contact_material;  ///< of each block or mesh whose nodes touch bodies
    std::vector<std::array<BodyIndex, 2>> beams;      ///< the bodies at the ends of each element
    std::vector<JointParameters> joints;              ///< by joint index
    std::vector<MotorParameters> motors;              ///< in the order of the file
    std::vector<ActuatorParameters> actuators;        ///< likewise, as the next three
    std::vector<SpringParameters> springs;
    std::vector<BushingParameters> bushings;
    std::vector<LoadParameters> loads;
    std::vector<AttachmentParameters> attachments;
    std::vector<SceneMaterial> materials;
    std::vector<SceneMaterialPair> material_pairs;
    std::vector<std::int32_t> shape_material;     ///< of each of system->shapes()
    std::vector<std::array<BodyIndex, 2>> apart;  ///< pairs of bodies that never touch, the smaller index first
    std::vector<LeftOut> left_out;
    bool leave_out = true;  ///< what the scene does not need; false: solved as if it needed everything
    bool surfaces_read = false, tetrahedra_read = false;  ///< from files: which modules the scene has loaded
};

/// A scene file as read.
struct Scene {
    std::string title;  ///< may be empty
    std::vector<SceneSystem> systems;
    /// What the systems were made of, written in one canonical way without `end`: two scenes with equal text take equal
    /// steps.
    std::string canonical;
};

/// Values of the command line that replace those of the file.
struct SceneOverrides {
    /// Paths of keys and list positions or names, "bodies.ball.mass", with values in YAML.
    std::vector<std::pair<std::string, std::string>> values;
    std::string solver;               ///< "name" or "name(key=value,…)" for every system; empty: the file's
    std::string integrator;           ///< likewise
    std::optional<Law> law;           ///< of friction, for every system
    std::optional<double> step, end;  ///< s, for every system; a step takes the place of a tolerance
    std::optional<double> tolerance;  ///< for every system, in place of a fixed step
    std::optional<double> accuracy;   ///< for every system, in place of a tolerance
    std::optional<bool> leave_out;    ///< for every system
};

/// Reads the whole scene and builds its systems. Throws InputError with file, line, key and the nearest valid key.
[[nodiscard]] DELASSUS_API Scene read_scene(const std::filesystem::path& file, const SceneOverrides& overrides = {});

/// The same from text; where names it in messages.
[[nodiscard]] DELASSUS_API Scene parse_scene(const std::string& yaml, std::string_view where,
                                             const SceneOverrides& overrides = {});

}  // namespace delassus
