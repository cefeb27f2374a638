// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "generate/bodies.hpp"
#include "generate/family.hpp"

namespace delassus {
namespace generating {
namespace {

const Field<GyroscopicParameters> gyroscopic_fields[] = {
    {"bodies", &GyroscopicParameters::bodies, 1, 1e6, "", "number of tops"},
    {"radius", &GyroscopicParameters::radius, 1e-6, 1e6, "m", "of the disc of a top"},
    {"height", &GyroscopicParameters::height, 1e-6, 1e6, "m", "from the tip of a top to its head"},
    {"mass", &GyroscopicParameters::mass, 1e-9, 1e9, "kg", "of a top"},
    {"spin", &GyroscopicParameters::spin, -1e6, 1e6, "rad/s",
     "about a top's own axis; neighbours in opposite directions"},
    {"nutation", &GyroscopicParameters::nutation, 0, 1e4, "rad/s", "amplitude of random angular velocities"},
    {"tilt", &GyroscopicParameters::tilt, 0, 1.5, "rad", "largest angle of a top to the vertical, about"},
    {"gravity", &GyroscopicParameters::gravity, 0, 1e3, "m/s^2", "along -z"},
    {"step", &GyroscopicParameters::step, 1e-9, 10, "s", "time step h"},
    {"seed", &GyroscopicParameters::seed, 0, kLargestSeed, "", "seed of the random angular velocities"},
};

}  // namespace

Family gyroscopic_family() {
    return make_family<GyroscopicParameters>(
        "gyroscopic", "spinning tops on one another, H unsymmetric by the exact gyroscopic Jacobian", gyroscopic_fields,
        &generate_gyroscopic);
}

}  // namespace generating

// A top is a homogeneous disc halfway up a massless axle: J = m r² diag(1/4, 1/4, 1/2). The unsymmetric H comes from
// Assembly::finish. About its own axis a top of spin s has
//     R = [ω̄]× J − [J ω̄]× = s (J₁ − J₃) [0 −1 0; 1 0 0; 0 0 0]
// and with J₃ = 2 J₁ the skew part of J + h R is h s times its symmetric part. The velocities before the step fit the
// joints exactly.
Problem generate_gyroscopic(const GyroscopicParameters& parameters) {
    using namespace generating;
    check_parameters<GyroscopicParameters>("gyroscopic", gyroscopic_fields, parameters);
    Random random(parameters.seed);
    Assembly assembly({parameters.gravity, parameters.step, false, true});
    const double disc = parameters.mass * parameters.radius * parameters.radius;
    const Vector3d head(0.0, 0.0, 0.5 * parameters.height);
    Vector3d joint = Vector3d::Zero();
    Vector3d joint_velocity = Vector3d::Zero();
    for (std::int32_t k = 0; k < parameters.bodies; ++k) {
        Body body;
        body.orientation = rotation(parameters.tilt * Vector3d(std::sin(0.7 * k + 0.4), std::cos(1.1 * k), 0.0));
        body.mass = parameters.mass;
        body.inertia = disc * Vector3d(0.25, 0.25, 0.5);
        body.angular_velocity = {0.0, 0.0, k % 2 == 0 ? parameters.spin : -parameters.spin};
        body.angular_velocity += random.vector(parameters.nutation);
        const Vector3d arm = body.orientation * head;
        const Vector3d turning = (body.orientation * body.angular_velocity).cross(arm);
        body.position = joint + arm;
        body.velocity = joint_velocity + turning;
        joint = body.position + arm;
        joint_velocity = body.velocity + turning;
        const std::int32_t top = assembly.add(body);
        if (k == 0) {
            assembly.spherical_joint(kWorld, Vector3d::Zero(), top, -head);
        } else {
            assembly.spherical_joint(top - 1, head, top, -head);
        }
    }
    return assembly.finish(fmt::format("gyroscopic-{}", parameters.bodies));
}

}  // namespace delassus
