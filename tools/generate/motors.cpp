// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "generate/bodies.hpp"
#include "generate/family.hpp"

namespace delassus {
namespace generating {
namespace {

const Field<MotorsParameters> motors_fields[] = {
    {"legs", &MotorsParameters::legs, 1, 1e5, "", "legs, on alternating sides"},
    {"trunk_mass", &MotorsParameters::trunk_mass, 1e-9, 1e9, "kg", "mass of the trunk"},
    {"link_mass", &MotorsParameters::link_mass, 1e-9, 1e9, "kg", "mass of a link"},
    {"link_length", &MotorsParameters::link_length, 1e-6, 1e6, "m", "length of a link"},
    {"torque", &MotorsParameters::torque, 0, 1e12, "N m", "limit of a motor"},
    {"motor_stiffness", &MotorsParameters::motor_stiffness, 0, 1e12, "N m s/rad",
     "slope of torque against speed; 0: infinite"},
    {"motor_speed", &MotorsParameters::motor_speed, -1e4, 1e4, "rad/s",
     "wanted speed of the hips; of the knees half, backwards"},
    {"bushing", &MotorsParameters::bushing, 0, 1e15, "N/m", "stiffness of a hinge's bearing; 0: rigid"},
    {"knee_clearance", &MotorsParameters::knee_clearance, 0, 1, "rad", "angle of each knee from its stop"},
    {"gap", &MotorsParameters::gap, 0, 1e3, "m", "under the feet"},
    {"mu", &MotorsParameters::mu, 0, 1e4, "", "friction coefficient; 0: one nonnegative row a contact"},
    {"speed", &MotorsParameters::speed, 0, 1e3, "m/s", "amplitude of random velocities"},
    {"gravity", &MotorsParameters::gravity, 0, 1e3, "m/s^2", "along -z"},
    {"step", &MotorsParameters::step, 1e-9, 10, "s", "time step h"},
    {"seed", &MotorsParameters::seed, 0, kLargestSeed, "", "seed of the random velocities"},
};

}  // namespace

Family motors_family() {
    return make_family<MotorsParameters>("motors",
                                         "a walking machine: every kind of cone, and compliance, in one problem",
                                         motors_fields, &generate_motors);
}

}  // namespace generating

// Every hinge turns about y. The rows, with ω the rotation of the outer link against the inner one about y:
//
// Bushing (free, 3 rows). A bearing of stiffness k holds with the force λ/h = −k C⁺, C⁺ = C + h Ċ. So
//     Ċ + C/h + λ/(h² k) = 0:        E = 1/(h² k), b = C/h.
// Motor (box, 1 row). Its torque is λ/h = c (ω_wanted − ω), but at most τ either way. So within the box
//     ω − ω_wanted + λ/(h c) = u = 0:        E = 1/(h c), b = −ω_wanted, |λ| ≤ h τ,
// and at a bound the wanted speed is missed to the side that the box's variational inequality says.
// Stop (nonnegative, 1 row). The knee's angle θ stays above θ_min: ω + (θ − θ_min)/h = u ≥ 0.
// Foot: a contact with the floor. A knee points forwards, so that the hip's and the knee's motors work against the stop
// and the friction of the foot.
Problem generate_motors(const MotorsParameters& parameters) {
    using namespace generating;
    check_parameters<MotorsParameters>("motors", motors_fields, parameters);
    Random random(parameters.seed);
    Assembly assembly({parameters.gravity, parameters.step, false, false});
    const double h = parameters.step;
    const double length = parameters.link_length;
    const double limit = h * parameters.torque;
    const double bushing = parameters.bushing > 0.0 ? 1.0 / (h * h * parameters.bushing) : 0.0;
    const double slip = parameters.motor_stiffness > 0.0 ? 1.0 / (h * parameters.motor_stiffness) : 0.0;
    const Vector3d link_edges(0.1 * length, 0.1 * length, length);
    const Vector3d upper_end(0.0, 0.0, 0.5 * length);  // body frame of a link
    // Angles about y from straight down. The thigh leans forwards, the shank backwards.
    const double thigh_angle = -0.5;
    const double shank_angle = 0.3;
    const double hip_height = parameters.gap + length * (std::cos(thigh_angle) + std::cos(shank_angle));

    const std::int32_t pairs = (parameters.legs + 1) / 2;
    const Vector3d trunk_edges(length * pairs, length, 0.3 * length);
    Body trunk;
    trunk.position = {0.0, 0.0, hip_height};
    trunk.mass = parameters.trunk_mass;
    trunk.inertia = box_inertia(trunk.mass, trunk_edges);
    shake(trunk, parameters.speed, parameters.speed / length, random);
    const std::int32_t trunk_number = assembly.add(trunk);

    const auto hinge = [&](std::int32_t inner, const Vector3d& point, std::int32_t outer, double speed) {
        assembly.spherical_joint(inner, point, outer, upper_end, bushing);
        assembly.hinge_axis(inner, Vector3d::UnitY(), outer, Vector3d::UnitY());
        assembly.relative_rotation(inner, outer, Vector3d::UnitY(), -speed, Cone::box({-limit}, {limit}), slip);
    };
    const auto link = [&](const Vector3d& joint, double angle) {
        Body body;
        body.orientation = rotation({0.0, angle, 0.0});
        body.position = joint - body.orientation * upper_end;
        body.mass = parameters.link_mass;
        body.inertia = box_inertia(body.mass, link_edges);
        shake(body, parameters.speed, parameters.speed / length, random);
        return assembly.add(body);
    };
    for (std::int32_t leg = 0; leg < parameters.legs; ++leg) {
        const double side = leg % 2 == 0 ? 0.5 : -0.5;
        const std::int32_t row = leg / 2;
        const Vector3d hip(length * (row - 0.5 * (pairs - 1)), side * length, 0.0);  // trunk's frame
        const std::int32_t thigh = link(trunk.position + hip, thigh_angle);
        const Vector3d knee = assembly.body(thigh).position - assembly.body(thigh).orientation * upper_end;
        const std::int32_t shank = link(knee, shank_angle);
        const Vector3d foot = assembly.body(shank).position - assembly.body(shank).orientation * upper_end;
        hinge(trunk_number, hip, thigh, parameters.motor_speed);
        hinge(thigh, -upper_end, shank, -0.5 * parameters.motor_speed);
        assembly.relative_rotation(thigh, shank, Vector3d::UnitY(), parameters.knee_clearance / h,
                                   Cone::nonnegative(1));
        assembly.contact(kWorld, shank, foot, Vector3d::UnitZ(), parameters.gap, parameters.mu);
    }
    return assembly.finish(fmt::format("motors-{}", parameters.legs));
}

}  // namespace delassus
