// SPDX-License-Identifier: BSD-3-Clause
// Mechanisms with published results, as multibody systems.
#pragma once

#include <cmath>
#include <memory>
#include <string>

#include "delassus/multibody.hpp"

namespace delassus::tests {

/// The quaternion of the rotation by an angle about z.
inline Quaternion about_z(double angle) {
    return {std::cos(0.5 * angle), 0.0, 0.0, std::sin(0.5 * angle)};
}

/// The angle about z of a body that turns about z alone, in (−π, π].
inline double angle_about_z(const Pose& pose) {
    return 2.0 * std::atan2(pose.orientation[3], pose.orientation[0]);
}

inline void add_revolute(MultibodySystem& system, BodyIndex first, BodyIndex second, const Vector3& point,
                         const Vector3& axis = {0.0, 0.0, 1.0}) {
    JointParameters joint;
    joint.kind = JointKind::Revolute;
    joint.first = first;
    joint.second = second;
    joint.point = point;
    joint.axis = axis;
    system.add_joint(joint);
}

/// A pendulum in the x–y plane: a point mass (with a small ball's inertia) at −x of the origin at rest, gravity along
/// −y. Spherical joints let it keep to the plane by itself.
inline std::unique_ptr<MultibodySystem> pendulum() {
    auto system = std::make_unique<MultibodySystem>();
    system->set_gravity({0.0, -9.81, 0.0});
    BodyParameters bob;
    bob.name = "bob";
    bob.mass = 1.0;
    bob.inertia = {1e-10, 1e-10, 1e-10};
    bob.pose.position = {-1.0, 0.0, 0.0};
    const auto body = system->add_body(bob);
    add_revolute(*system, world_body, body, {0.0, 0.0, 0.0});
    system->finish();
    return system;
}

/// The N-four-bar mechanism: N + 1 upright links on the ground, N links that join their tops; 1 m, 1 kg each, gravity
/// 9.81 along −y, the tops moving with +1 m/s along x. (González, Dopico, Luaces and Cuadrado, A benchmarking system
/// for MBS simulation software, 2006, problem A02.) Body 2k is the k-th upright link. A rod's moments about its own
/// axis and out of the plane do not matter here.
inline std::unique_ptr<MultibodySystem> four_bars(int windows) {
    auto system = std::make_unique<MultibodySystem>();
    system->set_gravity({0.0, -9.81, 0.0});
    const auto rod = [&](const std::string& name, double x, double y, double angle, double turning) {
        BodyParameters body;
        body.name = name;
        body.inertia = {1e-3, 1.0 / 12.0, 1.0 / 12.0};
        body.pose = {{x, y, 0.0}, about_z(angle)};
        body.velocity = {turning == 0.0 ? 1.0 : 0.5, 0.0, 0.0};
        body.angular_velocity = {0.0, 0.0, turning};
        return system->add_body(body);
    };
    BodyIndex last_top = world_body;
    for (int k = 0; k <= windows; ++k) {
        const double x = k;
        const auto upright = rod("upright", x, 0.5, 0.5 * M_PI, -1.0);
        add_revolute(*system, world_body, upright, {x, 0.0, 0.0});
        if (last_top != world_body) add_revolute(*system, last_top, upright, {x, 1.0, 0.0});
        if (k == windows) break;
        last_top = rod("top", x + 0.5, 1.0, 0.0, 0.0);
        add_revolute(*system, upright, last_top, {x, 1.0, 0.0});
    }
    system->finish();
    return system;
}

}  // namespace delassus::tests
