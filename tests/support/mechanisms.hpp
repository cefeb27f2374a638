// SPDX-License-Identifier: BSD-3-Clause
// Mechanisms with published results, as multibody systems.
#pragma once

#include <array>
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

/// Andrews' squeezing mechanism (Schiehlen, Multibody Systems Handbook, 1990; Mazzia and Magherini, Test Set for IVP
/// Solvers, 2008) of seven rigid bodies in space. Bodies in the order of their angles β, Θ (relative), γ, Φ (relative),
/// δ, Ω (relative), ε.
inline std::unique_ptr<MultibodySystem> squeezer() {
    constexpr std::array<double, 7> mass = {0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498};
    constexpr std::array<double, 7> moment = {2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5};
    constexpr double xa = -0.06934, ya = -0.00227, xb = -0.03635, yb = 0.03273, xc = 0.014, yc = 0.072;
    constexpr double c0 = 4530.0, l0 = 0.07785, d = 0.028, da = 0.0115, e = 0.02, ea = 0.01421, rr = 0.007,
                     ra = 0.00092;
    constexpr double sa = 0.01874, sb = 0.01043, sc = 0.018, sd = 0.02, ta = 0.02308, tb = 0.00916, u = 0.04,
                     ua = 0.01228, ub = 0.00449, zf = 0.02, zt = 0.04, fa = 0.01421, torque = 0.033;
    constexpr double beta = -0.0617138900142764496, theta = 0.0, gamma = 0.455279819163070380,
                     phi = 0.222668390165885885, delta = 0.487364979543842550, omega = -0.222668390165885885,
                     epsilon = 1.23054744454982119;
    auto system = std::make_unique<MultibodySystem>();
    system->set_gravity({0.0, 0.0, 0.0});
    const auto body = [&](std::size_t k, double x, double y, double angle) {
        BodyParameters parameters;
        parameters.name = "K";
        parameters.name += std::to_string(k + 1);
        parameters.mass = mass[k];
        parameters.inertia = {moment[k], moment[k], moment[k]};
        parameters.pose = {{x, y, 0.0}, about_z(angle)};
        return system->add_body(parameters);
    };
    const double fx = rr * std::cos(beta), fy = rr * std::sin(beta);
    const double ex = fx - d * std::cos(beta + theta), ey = fy - d * std::sin(beta + theta);
    const double gx = xa + zt * std::cos(delta), gy = ya + zt * std::sin(delta);
    const double hx = xa + u * std::sin(epsilon), hy = ya - u * std::cos(epsilon);
    const auto k1 = body(0, ra * std::cos(beta), ra * std::sin(beta), beta);
    const auto k2 = body(1, fx - da * std::cos(beta + theta), fy - da * std::sin(beta + theta), beta + theta);
    const auto k3 = body(2, xb + sa * std::sin(gamma) + sb * std::cos(gamma),
                         yb - sa * std::cos(gamma) + sb * std::sin(gamma), gamma);
    const auto k4 = body(3, gx + (e - ea) * std::sin(phi + delta), gy - (e - ea) * std::cos(phi + delta), phi + delta);
    const auto k5 = body(4, xa + ta * std::cos(delta) - tb * std::sin(delta),
                         ya + ta * std::sin(delta) + tb * std::cos(delta), delta);
    const auto k6 = body(5, hx + (zf - fa) * std::cos(omega + epsilon), hy + (zf - fa) * std::sin(omega + epsilon),
                         omega + epsilon);
    const auto k7 = body(6, xa + ua * std::sin(epsilon) - ub * std::cos(epsilon),
                         ya - ua * std::cos(epsilon) - ub * std::sin(epsilon), epsilon);
    add_revolute(*system, world_body, k1, {0.0, 0.0, 0.0});
    add_revolute(*system, k1, k2, {fx, fy, 0.0});
    add_revolute(*system, k2, k3, {ex, ey, 0.0});
    add_revolute(*system, k2, k4, {ex, ey, 0.0});
    add_revolute(*system, k2, k6, {ex, ey, 0.0});
    add_revolute(*system, world_body, k3, {xb, yb, 0.0});
    add_revolute(*system, k4, k5, {gx, gy, 0.0});
    add_revolute(*system, world_body, k5, {xa, ya, 0.0});
    add_revolute(*system, k6, k7, {hx, hy, 0.0});
    add_revolute(*system, world_body, k7, {xa, ya, 0.0});
    SpringParameters spring;
    spring.name = "CD";
    spring.first = world_body;
    spring.second = k3;
    spring.first_point = {xc, yc, 0.0};
    spring.second_point = {xb + sd * std::cos(gamma) + sc * std::sin(gamma),
                           yb + sd * std::sin(gamma) - sc * std::cos(gamma), 0.0};
    spring.stiffness = c0;
    spring.rest_length = l0;
    system->add_spring(spring);
    LoadParameters drive;
    drive.name = "drive";
    drive.body = k1;
    drive.torque[2] = Motion::constant(torque);
    system->add_load(drive);
    system->finish();
    return system;
}

/// Bricard's mechanism: six rods of 1 m and 1 kg along edges of a cube, one of them the ground, six revolute joints
/// whose axes are normal to both rods that they join; gravity 9.81 along −y. Grübler's formula counts 6·5 − 5·6 = 0
/// freedoms; it has one.
inline std::unique_ptr<MultibodySystem> bricard() {
    auto system = std::make_unique<MultibodySystem>();
    system->set_gravity({0.0, -9.81, 0.0});
    const std::array<Vector3, 6> corner = {{{1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}, {1, 0, 1}}};
    std::array<BodyIndex, 6> rods{};
    for (std::size_t k = 0; k < 5; ++k) {
        const Vector3 &from = corner[k], &to = corner[k + 1];
        BodyParameters rod;
        rod.name = "rod";
        rod.name += std::to_string(k);
        std::array<double, 3> moments{};
        for (std::size_t i = 0; i < 3; ++i) {
            rod.pose.position[i] = 0.5 * (from[i] + to[i]);
            moments[i] = from[i] == to[i] ? 1.0 / 12.0 : 1e-6;
        }
        rod.inertia = {moments[0], moments[1], moments[2]};
        rods[k] = system->add_body(rod);
    }
    rods[5] = world_body;
    for (std::size_t k = 0; k < 6; ++k) {  // at corner k, between rods k − 1 and k
        const auto before = (k + 5) % 6;
        Vector3 axis{1.0, 1.0, 1.0};
        for (const auto rod : {before, k})
            for (std::size_t i = 0; i < 3; ++i)
                if (corner[rod][i] != corner[(rod + 1) % 6][i]) axis[i] = 0.0;
        add_revolute(*system, rods[before], rods[k], corner[k], axis);
    }
    system->finish();
    return system;
}

}  // namespace delassus::tests
