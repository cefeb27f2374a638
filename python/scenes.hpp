// SPDX-License-Identifier: BSD-3-Clause
// Scenes and their simulation.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "delassus/registry.hpp"
#include "delassus/scene.hpp"
#include "delassus/simulation.hpp"
#include "guards.hpp"

namespace delassus::python {

/// A scene, and whose turn it is to use its systems: two simulations of one system may not step at the same time.
struct SharedScene {
    Scene scene;
    Turn turn;

    SharedScene(const std::string& text, bool is_file, const SceneOverrides& overrides) {
        const py::gil_scoped_release without_gil;
        scene = is_file ? read_scene(text, overrides) : parse_scene(text, "the scene", overrides);
    }

    [[nodiscard]] std::vector<std::string> names() const {
        std::vector<std::string> result;
        for (const SceneSystem& system : scene.systems) result.push_back(system.name);
        return result;
    }
    /// By name; '' is the only one. Throws InputError naming all.
    [[nodiscard]] SceneSystem& system(const std::string& name) {
        const auto all = [this] { return fmt::format("{}", fmt::join(names(), ", ")); };
        if (name.empty()) {
            if (scene.systems.size() == 1) return scene.systems.front();
            throw InputError(fmt::format("the scene has the systems {}: say which one by system=…", all()));
        }
        for (SceneSystem& system : scene.systems)
            if (system.name == name) return system;
        throw InputError(fmt::format("the scene has no system \"{}\", but {}", name, all()));
    }
};

/// A simulation with all that it refers to.
class SharedSimulation {
public:
    SharedSimulation(std::shared_ptr<SharedScene> scene, std::shared_ptr<const Registry> registry,
                     const std::string& system)
        : scene_(std::move(scene)), registry_(std::move(registry)) {
        SceneSystem& chosen = scene_->system(system);
        in_turn(scene_->turn, [&] { simulation_ = std::make_unique<Simulation>(chosen, *registry_); });
    }

    /// What look(simulation) returns, a value.
    template <typename Look>
    auto look(const Look& look) {
        return in_turn(scene_->turn, [&] { return look(*simulation_); });
    }

    StepRecord step() {
        Interrupts interrupts;
        StepRecord record;
        try {
            record = look([&](Simulation& simulation) {
                if (simulation.finished())
                    throw InputError(fmt::format("the simulation has reached its end, {} s: there is no further step",
                                                 simulation.system().end));
                simulation.solver().interrupt_by([&interrupts] { return interrupts.came(); });
                struct Forget {
                    StepSolver& solver;
                    ~Forget() { solver.interrupt_by(nullptr); }
                } const forget{simulation.solver()};
                return simulation.step();
            });
        } catch (const StepInterrupted&) {
            interrupts.rethrow();
            throw;
        }
        interrupts.rethrow();
        return record;
    }

private:
    std::shared_ptr<SharedScene> scene_;
    std::shared_ptr<const Registry> registry_;
    std::unique_ptr<Simulation> simulation_;
};

/// Of all bodies: position and unit quaternion (w, x, y, z); bodies × 7.
inline std::vector<double> poses_of(const Simulation& simulation) {
    const MultibodySystem& system = *simulation.system().system;
    std::vector<double> result;
    for (BodyIndex body = 0; body < system.body_count(); ++body) {
        const Pose pose = system.pose(simulation.state(), body);
        result.insert(result.end(), pose.position.begin(), pose.position.end());
        result.insert(result.end(), pose.orientation.begin(), pose.orientation.end());
    }
    return result;
}

/// Of all bodies: velocity of the mass centre in the world frame, angular velocity in the body frame; bodies × 6.
inline std::vector<double> twists_of(const Simulation& simulation) {
    const MultibodySystem& system = *simulation.system().system;
    std::vector<double> result;
    for (BodyIndex body = 0; body < system.body_count(); ++body)
        for (const Vector3& velocity : system.velocities(simulation.state(), body))
            result.insert(result.end(), velocity.begin(), velocity.end());
    return result;
}

/// Numbers of the joints that joint_coordinate() takes.
inline std::vector<std::int32_t> joints_with_coordinate(const MultibodySystem& system) {
    std::vector<std::int32_t> result;
    for (std::int32_t joint = 0; joint < system.joint_count(); ++joint)
        if (const JointKind kind = system.joint(joint).kind;
            kind == JointKind::Revolute || kind == JointKind::Cylindrical || kind == JointKind::Prismatic)
            result.push_back(joint);
    return result;
}

inline std::vector<std::string> joint_names_of(const Simulation& simulation) {
    const MultibodySystem& system = *simulation.system().system;
    std::vector<std::string> names;
    for (const std::int32_t joint : joints_with_coordinate(system)) names.push_back(system.joint(joint).name);
    return names;
}

/// Of these joints: coordinate and rate; joints × 2.
inline std::vector<double> joint_coordinates_of(const Simulation& simulation) {
    const MultibodySystem& system = *simulation.system().system;
    std::vector<double> result;
    for (const std::int32_t joint : joints_with_coordinate(system)) {
        const auto [coordinate, rate] = system.joint_coordinate(simulation.state(), joint);
        result.insert(result.end(), {coordinate, rate});
    }
    return result;
}

inline py::dict contacts_of(SharedSimulation& self) {
    const std::vector<ContactRecord> contacts =
        self.look([](const Simulation& simulation) { return simulation.contacts(); });
    std::vector<std::int32_t> bodies;
    std::vector<double> points, normals, gaps, forces;
    const auto append = [](std::vector<double>& to, const Vector3& vector) {
        to.insert(to.end(), vector.begin(), vector.end());
    };
    for (const ContactRecord& contact : contacts) {
        bodies.insert(bodies.end(), contact.bodies.begin(), contact.bodies.end());
        append(points, contact.point);
        append(normals, contact.normal);
        gaps.push_back(contact.gap);
        append(forces, contact.force);
    }
    const auto count = static_cast<py::ssize_t>(contacts.size());
    py::dict result;
    result["bodies"] = array_of(std::move(bodies), {count, 2});
    result["point"] = array_of(std::move(points), {count, 3});
    result["normal"] = array_of(std::move(normals), {count, 3});
    result["gap"] = array_of(std::move(gaps));
    result["force"] = array_of(std::move(forces), {count, 3});
    return result;
}

inline py::array rows_of(std::vector<double>&& values, py::ssize_t width) {
    const auto rows = static_cast<py::ssize_t>(values.size()) / width;
    return array_of(std::move(values), {rows, width});
}

inline std::shared_ptr<SharedScene> make_scene(const std::string& text, bool is_file,
                                               const std::vector<std::pair<std::string, std::string>>& values,
                                               const std::string& solver, const std::string& integrator,
                                               const std::optional<std::string>& law, std::optional<double> step,
                                               std::optional<double> end, std::optional<double> tolerance,
                                               std::optional<double> accuracy) {
    SceneOverrides overrides;
    overrides.values = values;
    overrides.solver = solver;
    overrides.integrator = integrator;
    if (law) overrides.law = law_of(*law);
    overrides.step = step;
    overrides.end = end;
    overrides.tolerance = tolerance;
    overrides.accuracy = accuracy;
    return std::make_shared<SharedScene>(text, is_file, overrides);
}

inline void bind_scenes(py::module_& module) {
    using namespace py::literals;

    py::class_<SharedScene, std::shared_ptr<SharedScene>>(module, "Scene")
        .def(py::init(&make_scene), "text"_a, "is_file"_a, "values"_a, "solver"_a, "integrator"_a, "law"_a, "step"_a,
             "end"_a, "tolerance"_a, "accuracy"_a)
        .def_property_readonly("title", [](const SharedScene& self) { return self.scene.title; })
        .def_property_readonly("systems", &SharedScene::names, "The names of its systems.")
        .def(
            "bodies",
            [](SharedScene& self, const std::string& system) {
                std::vector<std::string> names;
                for (const BodyParameters& body : self.system(system).bodies) names.push_back(body.name);
                return names;
            },
            "system"_a = "", "The names of a system's bodies, in the order of poses and twists.");

    py::class_<StepRecord>(module, "StepRecord", "What is known after a step (docs/running.md).")
        .def_readonly("step", &StepRecord::step, "Steps taken so far.")
        .def_readonly("time", &StepRecord::t, "s")
        .def_readonly("h", &StepRecord::h, "Size of the step, s.")
        .def_readonly("energy", &StepRecord::energy, "J; NaN where the system does not know it.")
        .def_readonly("kinetic", &StepRecord::kinetic, "The kinetic part of it, J.")
        .def_readonly("momentum", &StepRecord::momentum, "kg m/s")
        .def_readonly("angular_momentum", &StepRecord::angular_momentum, "About the origin, kg m²/s.")
        .def_readonly("drift", &StepRecord::drift, "Largest |C| of joints and motors, m or rad.")
        .def_readonly("penetration", &StepRecord::penetration, "Of the deepest contact, m; ≥ 0.")
        .def_readonly("contacts", &StepRecord::contacts, "Unilateral blocks in the step's problem.")
        .def_readonly("sleeping", &StepRecord::sleeping, "Bodies and nodes that sleep.")
        .def_readonly("newton_iterations", &StepRecord::newton_iterations)
        .def_readonly("solver_iterations", &StepRecord::solver_iterations)
        .def_readonly("natural", &StepRecord::natural, "Largest natural error of the step's solves.")
        .def_readonly("solved", &StepRecord::solved, "Whether every solve reached its tolerance.")
        .def_readonly("rejected", &StepRecord::rejected, "Trials of the step control that were thrown away.")
        .def_readonly("linearization", &StepRecord::linearization, "Error of a linearised method's forces.")
        .def_readonly("seconds", &StepRecord::seconds, "Wall time, s.")
        .def("__repr__", [](const StepRecord& record) {
            return fmt::format("<delassus.StepRecord: step {}, t = {} s, {} contacts, {}>", record.step, record.t,
                               record.contacts, record.solved ? "solved" : "a solve missed its tolerance");
        });

    py::class_<SharedSimulation>(module, "SceneRun")
        .def(py::init<std::shared_ptr<SharedScene>, std::shared_ptr<const Registry>, const std::string&>(), "scene"_a,
             "registry"_a, "system"_a)
        .def("step", &SharedSimulation::step,
             "Take one step and return its StepRecord. Raises StepFailure, Unsupported or InputError with the time in "
             "the sentence; everything is then as it was before the step.")
        .def_property_readonly(
            "finished",
            [](SharedSimulation& self) { return self.look([](const Simulation& s) { return s.finished(); }); },
            "Whether the scene's end is reached.")
        .def_property_readonly(
            "time", [](SharedSimulation& self) { return self.look([](const Simulation& s) { return s.state().t; }); },
            "s")
        .def_property_readonly(
            "positions",
            [](SharedSimulation& self) {
                return array_of(self.look([](const Simulation& s) { return std::vector(s.state().q); }));
            },
            "The coordinates q of all that can move, in the system's order (m, and unit quaternions w, x, y, z).")
        .def_property_readonly(
            "velocities",
            [](SharedSimulation& self) {
                return array_of(self.look([](const Simulation& s) { return std::vector(s.state().v); }));
            },
            "The velocities v of all that can move (m/s, rad/s).")
        .def_property_readonly(
            "poses", [](SharedSimulation& self) { return rows_of(self.look(poses_of), 7); },
            "Bodies × 7: position of the mass centre in the world (m), unit quaternion (w, x, y, z).")
        .def_property_readonly(
            "twists", [](SharedSimulation& self) { return rows_of(self.look(twists_of), 6); },
            "Bodies × 6: velocity of the mass centre in the world frame (m/s), angular velocity in the body frame "
            "(rad/s).")
        .def_property_readonly(
            "record", [](SharedSimulation& self) { return self.look([](const Simulation& s) { return s.record(); }); },
            "The StepRecord of the last step; of the start before the first.")
        .def_property_readonly(
            "multipliers",
            [](SharedSimulation& self) {
                return array_of(self.look([](const Simulation& s) { return s.multipliers(); }));
            },
            "λ of all rows of joints, motors and attachments after the last step, forces (N, Nm); empty before the "
            "first.")
        .def("contacts", &contacts_of,
             "The contacts of the last step, found where it began: a dict of arrays with a row each. 'bodies' × 2 "
             "(numbers in bodies(), −1 the world), 'point' × 3 (m), 'normal' × 3 (unit, from the first to the second), "
             "'gap' (m), 'force' × 3 (mean on the second body, world frame, N).")
        .def(
            "inputs",
            [](SharedSimulation& self) {
                return self.look([](const Simulation& s) {
                    std::vector<std::pair<std::string, double>> values;
                    for (const std::string& name : s.system().inputs.names()) values.emplace_back(name, s.input(name));
                    return values;
                });
            },
            "Names and values of the scene's inputs.")
        .def(
            "set_input",
            [](SharedSimulation& self, const std::string& name, double value) {
                self.look([&](Simulation& s) {
                    s.set_input(name, value);
                    return 0;
                });
            },
            "name"_a, "value"_a, "The input of this name has this value from now on.")
        .def(
            "joint_names", [](SharedSimulation& self) { return self.look(joint_names_of); },
            "Of the joints with one coordinate, in the order of joint_coordinates().")
        .def(
            "joint_coordinates", [](SharedSimulation& self) { return rows_of(self.look(joint_coordinates_of), 2); },
            "Joints × 2: coordinate (rad or m, 0 where the bodies are given) and rate.")
        .def(
            "warnings",
            [](SharedSimulation& self) { return self.look([](const Simulation& s) { return s.warnings(); }); },
            "What a user should know about the run so far, one sentence each.");
}

}  // namespace delassus::python
