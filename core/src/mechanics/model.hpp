// SPDX-License-Identifier: BSD-3-Clause
// What a multibody system is made of once it is finished: data for the loops of multibody.cpp.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "delassus/multibody.hpp"
#include "mechanics/angle.hpp"
#include "mechanics/modal_attachment.hpp"
#include "mechanics/prescribed_motion.hpp"
#include "mechanics/row.hpp"

namespace delassus::mechanics {

struct Body {
    BodyParameters parameters;
    Matrix3d inertia = Matrix3d::Identity();
    // Those of the metric in which starts are assembled: of a massless body, of what it carries.
    double metric_mass = 1.0;
    Matrix3d metric_inertia = Matrix3d::Identity();
    bool mass_of_beams = false;                          ///< the elements beside it have its mass and inertia
    std::int32_t position = -1, column = -1;             ///< first entries in q and v; −1 if fixed or prescribed
    std::shared_ptr<const PrescribedMotion> prescribed;  ///< null: it moves freely, or is fixed
};

/// What a step reads of each body that moves, side by side.
struct MovingBody {
    BodyIndex body = -1;
    std::int32_t position = -1, column = -1;
    bool diagonal = false;    ///< the inertia
    bool gyroscopic = false;  ///< its moments differ
    bool alone = true;        ///< no joint holds it, and no force but weight acts on it; contacts apart
    double mass = 0.0;
    Matrix3d inertia = Matrix3d::Identity();
};

struct Node {
    NodeParameters parameters;
    std::int32_t position = -1, column = -1;
    std::int32_t reduced = -1;  ///< the reduced body that it is a node of; it has no columns then
    bool touches = false;       ///< has a contact
    /// Whether forces can move it.
    [[nodiscard]] bool moves() const { return column >= 0 || reduced >= 0; }
};

/// A reduced body: its mesh until the system is finished, its modes from then on.
struct ReducedSolid {
    std::string name;
    std::unique_ptr<MultibodySystem> mesh;  ///< the elements at rest, alone
    std::int32_t first_node = 0, nodes = 0, modes = 0;
    double damping_time = 0.0, damping_rate = 0.0;
    Vector3 velocity{}, angular_velocity{};
    ModalModel model;
    std::int32_t position = -1, column = -1;
};

/// What a load of the system gives to a reduced body: the force `weight` F at the point.
struct ModalLoad {
    std::size_t load = 0;
    std::int32_t reduced = 0;
    double weight = 0.0;
    ModalPoint point;  ///< times the weight
};

/// c₂ − (p₁/q₂) c₁ = 0 of the coordinates of two joints; of angles modulo 2π/q₂, which the ratio p₁/q₂ of integers
/// makes a function of the orientations.
struct Gear {
    Row first, second;
    std::array<BodyIndex, 4> bodies{};  ///< of both
    double numerator = 1.0, denominator = 1.0;
    double offset = 0.0;  ///< times q₂, at t = 0

    [[nodiscard]] double ratio() const { return numerator / denominator; }
    /// Of a derivative of the coordinates, that of C.
    [[nodiscard]] double combined(double of_first, double of_second) const { return of_second - ratio() * of_first; }
    [[nodiscard]] double rate(const Placements& at, double t) const {
        return combined(first.rate(at, t), second.rate(at, t));
    }
    [[nodiscard]] double curvature(const Placements& at, double t) const {
        return combined(first.curvature(at, t), second.curvature(at, t));
    }
    [[nodiscard]] double value(const Placements& at, double t) const {
        const double C = denominator * second.value(at, t) - numerator * first.value(at, t) - offset;
        return (first.angle ? std::remainder(C, 2.0 * M_PI) : C) / denominator;
    }
};

/// A joint's rows, in order; a gear has one of its own.
struct Joint {
    JointParameters parameters;
    std::vector<Row> rows;            ///< its own, then one of each motor
    std::vector<std::string> motors;  ///< their names
    std::unique_ptr<Gear> gear;
    Row turn, slide;             ///< the coordinates about and along the axis
    std::int32_t first_row = 0;  ///< among all rows, kept or not
    /// Revolute, Prismatic: the coordinate.
    [[nodiscard]] const Row& coordinate() const { return parameters.kind == JointKind::Revolute ? turn : slide; }
    [[nodiscard]] std::int32_t row_count() const { return gear ? 1 : static_cast<std::int32_t>(rows.size()); }
};

/// A motor with a force limit: a box row on the speed of the joint's coordinate.
struct BoundedMotor {
    std::int32_t joint = -1;
    Motion speed;
    Cone box;  ///< of its limit
};

/// Forces of one row up to a limit, both ways.
inline Cone box_of(double limit) {
    return Cone::box({-limit}, {limit});
}

/// A servo with a force limit: a box row with a compliance.
struct BoundedActuator {
    std::int32_t joint = -1;
    Motion position, speed;  ///< both there
    double kp = 0.0, kd = 0.0;
    Cone box;  ///< of its limit
};

/// Dry friction in a coordinate of a joint: a box row on its speed.
struct JointFriction {
    std::int32_t joint = -1;
    bool turns = false;  ///< the coordinate is the angle, else the slide
    Cone box;            ///< of its bound
};

/// The force −(k C + c Ċ) ∇C of a row.
struct RowSpring {
    Row row;
    double stiffness = 0.0, damping = 0.0;
    bool potential = true;  ///< ½ k C² counts as energy; that of an actuator does not
    bool definite = false;  ///< its symmetric tangent is positive semidefinite: k ∇C ∇Cᵀ
};

/// Whether a spring with ω² = k/m, or its damper with c/m, is faster than a rate.
inline bool is_stiff(double squared_rate, double damping_rate, double rate) {
    return !(squared_rate <= rate * rate && damping_rate <= rate);
}

/// The torque −c (ω_second − ω_first) on the second body and its opposite on the first.
struct TurnDamper {
    BodyIndex first = world_body, second = world_body;
    double damping = 0.0;
};

struct Load {
    LoadParameters parameters;
    Vector3d point = Vector3d::Zero();  ///< body frame
};

/// Motions that rows point to; their addresses last.
using Motions = std::vector<std::unique_ptr<Motion>>;

inline Vector3d vector(const Vector3& v) {
    return {v[0], v[1], v[2]};
}
inline Vector3 array(const Vector3d& v) {
    return {v.x(), v.y(), v.z()};
}
inline Quaterniond quaternion(const Quaternion& q) {
    return {q[0], q[1], q[2], q[3]};
}

/// Three motions at a time; empty ones are 0.
inline Vector3d at_time(const std::array<Motion, 3>& motions, double t) {
    Vector3d result = Vector3d::Zero();
    for (std::size_t i = 0; i < 3; ++i)
        if (motions[i].value) result[static_cast<Eigen::Index>(i)] = motions[i].value(t);
    return result;
}

/// The rows of a joint of bodies at these placements. Throws InputError for an axis of no length, points that coincide
/// in a distance joint, a gear between joints that are not revolute.
Joint make_joint(const JointParameters& parameters, const Placements& at, const std::vector<Joint>& others);

/// Adds the rows by which a motor drives its joint.
void drive_joint(Joint& joint, const MotorParameters& motor, Motions& motions);

/// The springs of a bushing: three along the axes of the first body, three about them.
std::vector<RowSpring> make_bushing(const BushingParameters& parameters, const Placements& at);
RowSpring make_spring(const SpringParameters& parameters, const Placements& at);

}  // namespace delassus::mechanics
