// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "generate/bodies.hpp"
#include "generate/family.hpp"

namespace delassus {
namespace generating {
namespace {

const Field<ChainParameters> chain_fields[] = {
    {"bodies", &ChainParameters::bodies, 1, 1e6, "", "number of rods"},
    {"length", &ChainParameters::length, 1e-6, 1e6, "m", "length of a rod"},
    {"mass", &ChainParameters::mass, 1e-9, 1e9, "kg", "mass of the first rod"},
    {"mass_ratio", &ChainParameters::mass_ratio, 1e-12, 1e12, "", "mass of the last rod over that of the first"},
    {"heavy_end", &ChainParameters::heavy_end, 0, 1, "", "1: only the last rod has another mass; 0: geometric grading"},
    {"revolute", &ChainParameters::revolute, 0, 1, "", "1: hinges (5 rows); 0: spherical joints (3 rows)"},
    {"repeated", &ChainParameters::repeated, 1, 10, "",
     "how often each joint is written; more than once gives redundant rows"},
    {"planar", &ChainParameters::planar, 0, 1, "", "1: the rods lie in the x-z plane, all hinges along y"},
    {"closed", &ChainParameters::closed, 0, 1, "", "1: the last rod's end is joined to a fixed point too"},
    {"bend", &ChainParameters::bend, 0, 10, "", "tangent of the largest angle of a rod to the vertical, about"},
    {"world_frame", &ChainParameters::world_frame, 0, 1, "",
     "1: angular velocities in the world frame, H with full 3 x 3 blocks"},
    {"swing", &ChainParameters::swing, -1e3, 1e3, "rad/s", "rotation of the whole chain about its first joint"},
    {"speed", &ChainParameters::speed, 0, 1e3, "m/s, rad/s", "amplitude of random velocities of each rod"},
    {"drift", &ChainParameters::drift, -1, 1, "s",
     "for how long each rod has moved by its own velocity, breaking the joints"},
    {"gravity", &ChainParameters::gravity, 0, 1e3, "m/s^2", "along -z"},
    {"step", &ChainParameters::step, 1e-9, 10, "s", "time step h"},
    {"seed", &ChainParameters::seed, 0, kLargestSeed, "", "seed of the random velocities"},
};

// The direction of rod k, downwards: incommensurate waves, smooth along the chain and never the same twice.
Vector3d direction_of(const ChainParameters& parameters, std::int32_t k) {
    const double x = parameters.bend * std::sin(0.7 * k + 0.4);
    const double y = parameters.planar ? 0.0 : parameters.bend * std::cos(1.1 * k);
    return Vector3d(x, y, -1.0).normalized();
}

// The body frame of a rod has z along it. Where the chain is not planar the rods are twisted too, so that no frame is
// parallel to another.
Matrix3d orientation_of(const ChainParameters& parameters, const Vector3d& direction, std::int32_t k) {
    const Matrix3d turn = Eigen::Quaterniond::FromTwoVectors(-Vector3d::UnitZ(), direction).toRotationMatrix();
    const double twist = parameters.planar ? 0.0 : 0.3 * k;
    return turn * rotation({0.0, 0.0, twist});
}

// The pin of joint k, world frame. In space each pin crosses its rod, and neighbours turn against one another, as those
// of a real chain.
Vector3d pin_of(const ChainParameters& parameters, const Vector3d& direction, std::int32_t k) {
    if (parameters.planar) return Vector3d::UnitY();
    return direction.cross(Vector3d(std::cos(0.9 * k), std::sin(0.9 * k), 0.2)).normalized();
}

void check(const ChainParameters& parameters) {
    check_parameters<ChainParameters>("chain", chain_fields, parameters);
    const bool redundant = parameters.closed && parameters.planar && parameters.revolute;
    if (redundant && (parameters.drift != 0.0)) {
        throw InputError(
            "chain: drift breaks the joints of a closed planar chain of hinges so that its redundant rows contradict "
            "one another; set drift, closed, planar or revolute to 0");
    }
}

}  // namespace

Family chain_family() {
    return make_family<ChainParameters>("chain", "rods that hang from a fixed point by spherical joints or hinges",
                                        chain_fields, &generate_chain);
}

}  // namespace generating

// The joints hold in the given curve. With drift, each body is then moved by the exponential update of DESIGN section
// 5, r ← r + t v, A ← A exp([t ω̄]×), and the constraints, their Jacobian and b = C/h are taken where it arrives.
Problem generate_chain(const ChainParameters& parameters) {
    using namespace generating;
    check(parameters);
    Random random(parameters.seed);
    Assembly assembly({parameters.gravity, parameters.step, parameters.world_frame, false});
    const Vector3d edges(0.2 * parameters.length, 0.1 * parameters.length, parameters.length);
    const Vector3d top(0.0, 0.0, 0.5 * parameters.length);  // body frame: the end towards the fixed point
    // About the first pin, if there is one; a spherical joint allows any axis.
    const Vector3d axis = parameters.revolute ? pin_of(parameters, direction_of(parameters, 0), 0)
                                              : Vector3d(Vector3d(0.3, 1.0, 0.2).normalized());
    const Vector3d swing = parameters.swing * axis;

    // Each joint's pin in the frames of the bodies on both sides, before they drift.
    struct Pin {
        Vector3d before, after;
    };
    std::vector<Pin> pins;
    Vector3d end = Vector3d::Zero();
    Matrix3d last_orientation = Matrix3d::Identity();
    for (std::int32_t k = 0; k < parameters.bodies; ++k) {
        const Vector3d direction = direction_of(parameters, k);
        Body body;
        body.orientation = orientation_of(parameters, direction, k);
        body.position = end - body.orientation * top;
        body.mass = graded(parameters.mass, parameters.mass_ratio, parameters.heavy_end, k, parameters.bodies);
        body.inertia = box_inertia(body.mass, edges);
        body.velocity = swing.cross(body.position);
        body.angular_velocity = body.orientation.transpose() * swing;
        shake(body, parameters.speed, parameters.speed, random);

        const Vector3d pin = pin_of(parameters, direction, k);
        pins.push_back({last_orientation.transpose() * pin, body.orientation.transpose() * pin});
        end = body.position - body.orientation * top;
        last_orientation = body.orientation;
        if (k == parameters.bodies - 1) pins.push_back({last_orientation.transpose() * pin, pin});

        body.position += parameters.drift * body.velocity;
        body.orientation = (body.orientation * rotation(parameters.drift * body.angular_velocity)).eval();
        assembly.add(body);
    }

    const std::int32_t joints = parameters.bodies + (parameters.closed ? 1 : 0);
    for (std::int32_t k = 0; k < joints; ++k) {
        const std::int32_t before = k == 0 ? kWorld : k - 1;
        const std::int32_t after = k == parameters.bodies ? kWorld : k;
        const Vector3d point_before = k == 0 ? Vector3d::Zero() : Vector3d(-top);
        const Vector3d point_after = k == parameters.bodies ? end : top;
        for (std::int32_t copy = 0; copy < parameters.repeated; ++copy) {
            assembly.spherical_joint(before, point_before, after, point_after);
            const Pin& pin = pins[static_cast<std::size_t>(k)];
            if (parameters.revolute) assembly.hinge_axis(before, pin.before, after, pin.after);
        }
    }
    return assembly.finish(fmt::format("chain-{}", parameters.bodies));
}

}  // namespace delassus
