// SPDX-License-Identifier: BSD-3-Clause
// Example scenes, run in this process.
#pragma once

#include <filesystem>
#include <string>

#include "delassus/simulation.hpp"
#include "support/places.hpp"

namespace delassus::tests {

inline std::string example_scene(const std::string& name) {
    return (std::filesystem::path(tests::places::source) / "examples" / "scenes" / (name + ".yaml")).string();
}

inline const Registry& registry() {
    static const Registry installed;
    return installed;
}

/// A system of a scene, and its simulation.
struct Running {
    Scene scene;
    Simulation simulation;

    explicit Running(Scene read, std::size_t system = 0)
        : scene(std::move(read)), simulation(scene.systems.at(system), registry()) {}

    void finish() {
        while (!simulation.finished()) simulation.step();
    }
    [[nodiscard]] const MultibodySystem& system() const { return *simulation.system().system; }
    [[nodiscard]] Pose pose(const std::string& body) const {
        return system().pose(simulation.state(), system().find_body(body));
    }
    [[nodiscard]] std::array<Vector3, 2> velocities(const std::string& body) const {
        return system().velocities(simulation.state(), system().find_body(body));
    }
};

}  // namespace delassus::tests
