// SPDX-License-Identifier: BSD-3-Clause
// Building a multibody system, and reading its states.
#include "delassus/multibody.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "mechanics/checks.hpp"
#include "mechanics/multibody_implementation.hpp"
#include "problem/cone_kinds.hpp"

namespace delassus {

using mechanics::array;
using mechanics::finite;
using mechanics::Matrix3d;
using mechanics::quaternion;
using mechanics::Quaterniond;
using mechanics::refuse_unless;
using mechanics::vector;
using mechanics::Vector3d;

namespace {

Matrix3d tensor(const Inertia& J) {
    Matrix3d result;
    result << J.xx, J.xy, J.xz, J.xy, J.yy, J.yz, J.xz, J.yz, J.zz;
    return result;
}

// The moments of a mass distribution are ∫(y² + z²) and so on: none exceeds the sum of the other two.
void check_inertia(const std::string& name, const Matrix3d& J) {
    refuse_unless(J.allFinite(), "the inertia of body", name, "is not finite");
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(J, Eigen::EigenvaluesOnly);
    const Vector3d& moments = solver.eigenvalues();
    refuse_unless(moments[0] > 0.0, "the inertia of body", name, "is not positive definite");
    refuse_unless(
        moments[2] <= (moments[0] + moments[1]) * (1.0 + 1e-9), "the inertia of body", name,
        fmt::format("has the principal moments {}, {}, {}; the largest exceeds the sum of the others, which no mass "
                    "distribution has",
                    moments[0], moments[1], moments[2]));
}

Quaternion normalized(const Quaternion& q, const std::string& name) {
    const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    refuse_unless(norm > 0.0 && std::isfinite(norm), "the orientation of", name,
                  "is not a quaternion of positive length");
    return {q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm};
}

}  // namespace

MultibodySystem::MultibodySystem() : implementation_(std::make_unique<Implementation>()) {}
MultibodySystem::~MultibodySystem() = default;

void MultibodySystem::Implementation::must_be_finished() const {
    if (!finished) throw InputError("the multibody system was not finished: call finish() after the last add_…()");
}
void MultibodySystem::Implementation::must_not_be_finished() const {
    if (finished) throw InputError("the multibody system is finished; nothing can be added to it any more");
}
void MultibodySystem::Implementation::check_body(BodyIndex body, const std::string& name) const {
    if (body < world_body || body >= static_cast<BodyIndex>(bodies.size()))
        throw InputError(fmt::format("\"{}\" names the body {}; there are {}", name, body, bodies.size()));
}

void MultibodySystem::set_gravity(const Vector3& gravity) {
    refuse_unless(finite(gravity), "the value", "gravity", "is not finite");
    implementation_->gravity = gravity;
    ++implementation_->revision;
}

BodyIndex MultibodySystem::add_body(const BodyParameters& parameters) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    const auto& name = parameters.name;
    refuse_unless(parameters.massless || (std::isfinite(parameters.mass) && parameters.mass > 0.0), "the mass of body",
                  name, fmt::format("is {} kg; it must be positive", parameters.mass));
    refuse_unless(!parameters.massless || !(parameters.fixed || parameters.motion), "the body", name,
                  "is massless, and is fixed or has a motion; it can be one of them");
    refuse_unless(finite(parameters.pose.position), "the position of body", name, "is not finite");
    refuse_unless(finite(parameters.velocity) && finite(parameters.angular_velocity), "the velocity of body", name,
                  "is not finite");
    mechanics::Body body;
    body.parameters = parameters;
    body.parameters.pose.orientation = normalized(parameters.pose.orientation, name);
    if (parameters.massless) {
        body.parameters.mass = 0.0;
        body.parameters.inertia = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    }
    body.inertia = tensor(body.parameters.inertia);
    if (parameters.motion) {
        const BodyMotion& motion = *parameters.motion;
        refuse_unless(!parameters.fixed, "the body", name, "is fixed and has a motion; it can have one of them");
        refuse_unless(finite(motion.axis) && vector(motion.axis).norm() > 0.0, "the axis of the motion of body", name,
                      "has no direction");
        refuse_unless(!motion.point || finite(*motion.point), "the point of the motion of body", name, "is not finite");
        self.motion_corners.add(motion.translation);
        self.motion_corners.add(motion.angle);
        body.prescribed = std::make_shared<mechanics::PrescribedMotion>(motion, body.parameters.pose);
        body.parameters.pose = body.prescribed->pose(0.0);
        refuse_unless(finite(body.parameters.pose.position) && std::isfinite(body.parameters.pose.orientation[0]),
                      "the motion of body", name, "is not finite at t = 0");
    } else if (!parameters.fixed && !parameters.massless) {
        check_inertia(name, body.inertia);
    }
    self.bodies.push_back(std::move(body));
    return static_cast<BodyIndex>(self.bodies.size()) - 1;
}

std::int32_t MultibodySystem::add_node(const NodeParameters& parameters) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    refuse_unless(std::isfinite(parameters.mass) && parameters.mass >= 0.0, "the mass of node", parameters.name,
                  fmt::format("is {} kg; it must not be negative", parameters.mass));
    refuse_unless(finite(parameters.position) && finite(parameters.velocity), "the state of node", parameters.name,
                  "is not finite");
    self.nodes.push_back({parameters, -1, -1});
    return static_cast<std::int32_t>(self.nodes.size()) - 1;
}

mechanics::Placements MultibodySystem::Implementation::initial_placements() const {
    mechanics::Placements result(bodies.size());
    result.angles.assign(counted.size(), 0.0);
    for (std::size_t k = 0; k < bodies.size(); ++k) {
        auto& place = result[static_cast<BodyIndex>(k)];
        place.x = vector(bodies[k].parameters.pose.position);
        place.A = quaternion(bodies[k].parameters.pose.orientation).toRotationMatrix();
    }
    return result;
}

std::int32_t MultibodySystem::add_joint(const JointParameters& parameters) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    const auto& name = parameters.name;
    if (parameters.kind != JointKind::Gear) {
        self.check_body(parameters.first, name);
        self.check_body(parameters.second, name);
        refuse_unless(parameters.first != parameters.second, "the joint", name, "joins a body to itself");
        refuse_unless(finite(parameters.point) && finite(parameters.second_point), "the point of the joint", name,
                      "is not finite");
    }
    const bool limited = !std::isnan(parameters.lower) || !std::isnan(parameters.upper);
    refuse_unless(!limited || parameters.kind == JointKind::Revolute || parameters.kind == JointKind::Prismatic,
                  "the joint", name, "cannot have limits: only revolute and prismatic joints can");
    refuse_unless(
        !(parameters.lower > parameters.upper), "the limits of the joint", name,
        fmt::format("are {} and {}; the lower must not exceed the upper", parameters.lower, parameters.upper));
    mechanics::check_joint_forces(parameters);
    self.joints.push_back(mechanics::make_joint(parameters, self.initial_placements(), self.joints));
    if (parameters.kind != JointKind::Gear) keep_apart(parameters.first, parameters.second);
    const auto index = static_cast<std::int32_t>(self.joints.size()) - 1;
    if (parameters.kind == JointKind::Revolute && (limited || parameters.turn.start)) self.count_turns_of(index);
    if (parameters.kind == JointKind::Cylindrical && parameters.turn.start) self.count_turns_of(index);
    self.add_joint_forces(index);
    return index;
}

void MultibodySystem::add_motor(const MotorParameters& motor) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    const auto& name = motor.name;
    refuse_unless(motor.joint >= 0 && motor.joint < static_cast<std::int32_t>(self.joints.size()), "the motor", name,
                  "drives no joint of the system");
    auto& joint = self.joints[static_cast<std::size_t>(motor.joint)];
    refuse_unless(joint.parameters.kind == JointKind::Revolute || joint.parameters.kind == JointKind::Prismatic,
                  "the motor", name, "must drive a revolute or a prismatic joint");
    refuse_unless(motor.motion.value && motor.motion.rate && motor.motion.acceleration, "the motor", name,
                  "has no motion");
    refuse_unless(motor.force_limit >= 0.0, "the force limit of the motor", name, "must not be negative");
    self.motion_corners.add(motor.motion);
    if (std::isinf(motor.force_limit)) {
        if (joint.parameters.kind == JointKind::Revolute) self.count_turns_of(motor.joint);
        mechanics::drive_joint(joint, motor, self.motions);
    } else {
        refuse_unless(motor.speed, "the motor", name, "has a force limit, so it must be driven by speed");
        self.bounded_motors.push_back({motor.joint, motor.motion, mechanics::box_of(motor.force_limit)});
    }
}

void MultibodySystem::add_actuator(const ActuatorParameters& actuator) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    const auto& name = actuator.name;
    refuse_unless(actuator.joint >= 0 && actuator.joint < static_cast<std::int32_t>(self.joints.size()), "the actuator",
                  name, "drives no joint of the system");
    const JointKind kind = self.joints[static_cast<std::size_t>(actuator.joint)].parameters.kind;
    refuse_unless(kind == JointKind::Revolute || kind == JointKind::Prismatic, "the actuator", name,
                  "must drive a revolute or a prismatic joint");
    refuse_unless(mechanics::finite_and_not_negative({actuator.kp, actuator.kd}) && actuator.kp + actuator.kd > 0.0,
                  "the gains of the actuator", name, "must be finite and not negative, and kp or kd must be positive");
    refuse_unless(actuator.force_limit >= 0.0, "the force limit of the actuator", name, "must not be negative");
    const bool position = static_cast<bool>(actuator.position.value), speed = static_cast<bool>(actuator.speed.value);
    refuse_unless(position == (actuator.kp > 0.0), "the actuator", name,
                  position ? "has a position to go to, but no kp" : "has a kp, but no position to go to");
    refuse_unless(position || speed, "the actuator", name, "has neither a position nor a speed to go to");
    self.motion_corners.add(actuator.position);
    self.motion_corners.add(actuator.speed);
    const auto zero = [](double) { return 0.0; };
    const Motion& place = position ? actuator.position : Motion{zero, zero, zero, zero};
    const auto rate = speed ? actuator.speed.value : actuator.position.rate;
    if (!std::isinf(actuator.force_limit)) {
        self.bounded_actuators.push_back({actuator.joint,
                                          place,
                                          {rate, nullptr, nullptr, nullptr},
                                          actuator.kp,
                                          actuator.kd,
                                          mechanics::box_of(actuator.force_limit)});
        if (kind == JointKind::Revolute) self.count_turns_of(actuator.joint);
        return;
    }
    const auto drive = [&](double kp, double kd, const Motion& target) {
        self.motions.push_back(std::make_unique<Motion>(target));
        self.add_coordinate_spring(actuator.joint, kind == JointKind::Revolute, kp, kd, 0.0, self.motions.back().get(),
                                   false);
    };
    if (actuator.kp > 0.0) drive(actuator.kp, 0.0, place);
    if (actuator.kd > 0.0) drive(0.0, actuator.kd, {zero, rate, nullptr, nullptr});
}

void MultibodySystem::add_spring(const SpringParameters& spring) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    self.check_body(spring.first, spring.name);
    self.check_body(spring.second, spring.name);
    refuse_unless(spring.first != spring.second, "the spring", spring.name, "joins a body to itself");
    refuse_unless(spring.stiffness >= 0.0 && spring.damping >= 0.0 && std::isfinite(spring.stiffness + spring.damping),
                  "the stiffness and damping of the spring", spring.name, "must be finite and not negative");
    refuse_unless(!(spring.rest_length < 0.0), "the rest length of the spring", spring.name, "must not be negative");
    self.springs.push_back(mechanics::make_spring(spring, self.initial_placements()));
}

void MultibodySystem::add_bushing(const BushingParameters& bushing) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    self.check_body(bushing.first, bushing.name);
    self.check_body(bushing.second, bushing.name);
    refuse_unless(bushing.first != bushing.second, "the bushing", bushing.name, "joins a body to itself");
    for (const auto* values : {&bushing.stiffness, &bushing.damping, &bushing.turn_stiffness, &bushing.turn_damping})
        for (const double value : *values)
            refuse_unless(value >= 0.0 && std::isfinite(value), "the stiffness and damping of the bushing",
                          bushing.name, "must be finite and not negative");
    for (auto& spring : mechanics::make_bushing(bushing, self.initial_placements())) self.springs.push_back(spring);
}

void MultibodySystem::add_load(const LoadParameters& load) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    self.motion_corners.add(load.force);
    self.motion_corners.add(load.torque);
    if (!load.nodes.empty()) {
        for (const auto& [node, share] : load.nodes) self.check_node(node, fmt::format("the load \"{}\"", load.name));
        const bool turns = load.torque[0].value || load.torque[1].value || load.torque[2].value;
        refuse_unless(load.body == world_body && !load.follower && !turns, "the load", load.name,
                      "acts on nodes, which take a force in the world frame and nothing else");
        self.loads.push_back({load});
        return;
    }
    self.check_body(load.body, load.name);
    refuse_unless(load.body != world_body, "the load", load.name, "acts on no body");
    const auto at = self.initial_placements();
    self.loads.push_back({load, at[load.body].A.transpose() * (vector(load.point) - at[load.body].x)});
}

namespace {

void check_material(const ContactMaterial& material) {
    const sdk::ConeParameter& friction = operations_of(ConeKind::Friction).named_parameters()[0];
    if (!friction.takes(material.friction))
        throw InputError(
            fmt::format("the friction coefficient is {}; it must be {}", material.friction, domain_of(friction)));
    if (!(material.restitution >= 0.0 && material.restitution <= 1.0))
        throw InputError(fmt::format("the restitution is {}; it must lie between 0 and 1", material.restitution));
}

}  // namespace

std::int32_t MultibodySystem::add_material(const ContactMaterial& material) {
    auto& self = *implementation_;
    check_material(material);
    self.materials.push_back(material);
    return static_cast<std::int32_t>(self.materials.size()) - 1;
}

void MultibodySystem::set_material_pair(std::int32_t first, std::int32_t second, const ContactMaterial& material) {
    auto& self = *implementation_;
    const auto count = static_cast<std::int32_t>(self.materials.size());
    if (first < 0 || second < 0 || first >= count || second >= count)
        throw InputError(fmt::format("a material pair names {} and {}; there are {} materials", first, second, count));
    check_material(material);
    self.material_pairs[std::minmax(first, second)] = material;
}

void MultibodySystem::add_shape(const Shape& shape, std::int32_t material) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    self.check_body(shape.body, "a shape");
    if (material < 0 || material >= static_cast<std::int32_t>(self.materials.size()))
        throw InputError(fmt::format("a shape has the material {}; there are {}", material, self.materials.size()));
    self.shapes.push_back(shape);
    self.shape_material.push_back(material);
}

void MultibodySystem::add_node_contact(std::int32_t node, double radius, std::int32_t material) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    self.check_node(node, "a contact");
    if (!(radius > 0.0) || !std::isfinite(radius))
        throw InputError(fmt::format("the contact radius of node {} is {} m; it must be positive", node, radius));
    if (material < 0 || material >= static_cast<std::int32_t>(self.materials.size()))
        throw InputError(fmt::format("the contact of node {} has the material {}; there are {}", node, material,
                                     self.materials.size()));
    self.node_contacts.push_back({node, radius, material});
    self.nodes[static_cast<std::size_t>(node)].touches = true;
}

void MultibodySystem::set_envelope(double envelope) {
    if (!(envelope > 0.0) || !std::isfinite(envelope))
        throw InputError(fmt::format("the contact envelope is {} m; it must be positive", envelope));
    implementation_->envelope = envelope;
    implementation_->wanted_envelope = envelope;
}

void MultibodySystem::keep_apart(BodyIndex first, BodyIndex second) {
    auto& self = *implementation_;
    self.check_body(first, "keep_apart");
    self.check_body(second, "keep_apart");
    self.apart.insert(std::minmax(first, second));
}

void MultibodySystem::leave_nothing_out() {
    implementation_->must_not_be_finished();
    implementation_->leaves_out = false;
}

bool MultibodySystem::Implementation::is_round_about_its_axis(BodyIndex index) const {
    const auto& motion = *bodies[static_cast<std::size_t>(index)].prescribed;
    return std::all_of(shapes.begin(), shapes.end(), [&](const Shape& shape) {
        if (shape.body != index) return true;
        const Vector3d center = vector(shape.pose.position);
        if (shape.kind == ShapeKind::Sphere) return motion.turns_about(center, Vector3d::Zero());
        const bool along = shape.kind == ShapeKind::Cylinder || shape.kind == ShapeKind::Capsule;
        return along && motion.turns_about(center, quaternion(shape.pose.orientation) * Vector3d::UnitZ());
    });
}

void MultibodySystem::finish() {
    auto& self = *implementation_;
    self.must_not_be_finished();
    for (std::size_t k = 0; k < self.bodies.size(); ++k) {
        auto& body = self.bodies[k];
        if (body.parameters.fixed) continue;
        if (body.prescribed) {
            self.prescribed.push_back(static_cast<BodyIndex>(k));
            if (!self.is_round_about_its_axis(static_cast<BodyIndex>(k)))
                self.uneven.push_back(static_cast<BodyIndex>(k));
            continue;
        }
        body.position = self.position_size;
        body.column = self.n;
        self.position_size += 7;
        self.n += 6;
        const Matrix3d J = body.mass_of_beams ? Matrix3d::Zero().eval() : body.inertia;
        const bool gyroscopic = !body.mass_of_beams && !J.isApprox(J(0, 0) * Matrix3d::Identity(), 1e-14);
        self.moving.push_back({.body = static_cast<BodyIndex>(k),
                               .position = body.position,
                               .column = body.column,
                               .diagonal = J.isDiagonal(0.0),
                               .gyroscopic = gyroscopic,
                               .mass = body.mass_of_beams ? 0.0 : body.parameters.mass,
                               .inertia = J});
        self.gyroscopic = self.gyroscopic || gyroscopic;
    }
    for (auto& node : self.nodes) {
        if (node.parameters.fixed || node.reduced >= 0) continue;
        refuse_unless(node.parameters.mass > 0.0, "the node", node.parameters.name,
                      "has no mass and no element gives it any");
        node.position = self.position_size;
        node.column = self.n;
        self.position_size += 3;
        self.n += 3;
    }
    self.reduce_bodies();
    self.first_angle = self.position_size;
    self.position_size += static_cast<std::int32_t>(self.counted.size());
    self.at = self.initial_placements();
    for (std::size_t k = 0; k < self.bodies.size(); ++k)
        self.at[static_cast<BodyIndex>(k)].column =
            self.bodies[k].prescribed ? mechanics::prescribed_column(static_cast<BodyIndex>(k)) : self.bodies[k].column;
    std::int32_t rows = 0;
    for (auto& joint : self.joints) {
        joint.first_row = rows;
        rows += joint.row_count();
    }
    for (auto& attachment : self.attachments) {
        attachment.first_row = rows;
        rows += 3;
    }
    for (auto& attachment : self.modal_attachments) {
        attachment.first_row = rows;
        rows += attachment.rows();
    }
    self.place_of_row.assign(static_cast<std::size_t>(rows), 0);
    self.number_rows();
    self.make_metric();
    self.driven = self.find_driven();
    self.finished = true;
    self.find_bodies_alone(*this);
    self.make_detector();
}

// A massless body takes the mass of the next one that has some, along joints, and its inertia as if it were alike in
// all directions. Where joints lead to none, it keeps unit mass: joint coordinates refuse it.
void MultibodySystem::Implementation::make_metric() {
    std::vector<std::size_t> reached;
    for (std::size_t k = 0; k < bodies.size(); ++k) {
        bodies[k].metric_mass = bodies[k].parameters.mass;
        bodies[k].metric_inertia = bodies[k].inertia;
        if (bodies[k].parameters.massless) {
            bodies[k].metric_mass = 1.0;
            bodies[k].metric_inertia.setIdentity();
        } else if (bodies[k].column >= 0) {
            reached.push_back(k);
        }
    }
    if (std::none_of(bodies.begin(), bodies.end(), [](const auto& body) { return body.parameters.massless; })) return;
    std::vector<std::vector<std::size_t>> neighbours(bodies.size());
    for (const auto& joint : joints) {
        const auto [a, b] = std::pair(joint.parameters.first, joint.parameters.second);
        if (joint.gear || a == world_body || b == world_body) continue;
        neighbours[static_cast<std::size_t>(a)].push_back(static_cast<std::size_t>(b));
        neighbours[static_cast<std::size_t>(b)].push_back(static_cast<std::size_t>(a));
    }
    std::vector<char> known(bodies.size(), 0);
    for (const auto k : reached) known[k] = 1;
    for (std::size_t next = 0; next < reached.size(); ++next)
        for (const auto other : neighbours[reached[next]]) {
            if (known[other] || !bodies[other].parameters.massless) continue;
            const auto& from = bodies[reached[next]];
            bodies[other].metric_mass = from.metric_mass;
            bodies[other].metric_inertia = from.metric_inertia.trace() / 3.0 * Matrix3d::Identity();
            known[other] = 1;
            reached.push_back(other);
        }
}

std::string MultibodySystem::needs_joint_coordinates() const {
    const auto& self = *implementation_;
    for (const auto& body : self.bodies)
        if (body.parameters.massless) return fmt::format("the body \"{}\" has no mass", body.parameters.name);
    for (const auto& joint : self.joints)
        if (joint.parameters.slide.armature > 0.0 || joint.parameters.turn.armature > 0.0)
            return fmt::format("the joint \"{}\" has an armature", joint.parameters.name);
    return {};
}

// By the entries that forces and constraints add at the start.
void MultibodySystem::Implementation::find_bodies_alone(const MultibodySystem& system) {
    if (!gyroscopic) return;
    const State start = system.initial_state();
    MatrixAssembler matrix;
    const std::int32_t rows = system.m();
    matrix.begin(std::max(n, rows), n);
    if (rows > 0) system.add_constraint_jacobian(start, 0, matrix);
    system.add_stiffness(start, 1.0, Tangent::Exact, matrix);
    system.add_damping(start, 1.0, Tangent::Exact, matrix);
    std::vector<bool> held(static_cast<std::size_t>(n), false);
    for (const std::int32_t column : matrix.finish().column) held[static_cast<std::size_t>(column)] = true;
    for (auto& body : moving) {
        const auto first = held.begin() + body.column;
        body.alone = std::find(first, first + 6, true) == first + 6;
    }
}

// ---- Reading states ----

void MultibodySystem::Implementation::place(const double* q, const double* v, double t) const {
    must_be_finished();
    for (const auto index : prescribed) bodies[static_cast<std::size_t>(index)].prescribed->place(t, at[index]);
    for (const auto& body : moving) {
        auto& place = at[body.body];
        const double* from = q + body.position;
        place.x = Eigen::Map<const Vector3d>(from);
        place.A = Quaterniond(from[3], from[4], from[5], from[6]).toRotationMatrix();
        if (v) {
            place.v = Eigen::Map<const Vector3d>(v + body.column);
            place.omega = Eigen::Map<const Vector3d>(v + body.column + 3);
        }
    }
    std::copy_n(q + first_angle, counted.size(), at.angles.begin());
    place_modal(q, v);
}

mechanics::NodePlacement MultibodySystem::Implementation::node_at(std::int32_t index, const double* q,
                                                                  const double* v) const {
    const auto& node = nodes[static_cast<std::size_t>(index)];
    if (node.reduced >= 0 && finished) return node_of_reduced(index, q, v);
    if (node.column < 0) return {vector(node.parameters.position), Vector3d::Zero(), -1};
    return {Eigen::Map<const Vector3d>(q + node.position), Eigen::Map<const Vector3d>(v + node.column), node.column};
}

std::int32_t MultibodySystem::node_count() const {
    return static_cast<std::int32_t>(implementation_->nodes.size());
}
Vector3 MultibodySystem::node_position(const State& state, std::int32_t node) const {
    implementation_->check_node(node, "node_position()");
    return array(implementation_->node_at(node, state.q.data(), state.v.data()).x);
}
Vector3 MultibodySystem::node_velocity(const State& state, std::int32_t node) const {
    implementation_->check_node(node, "node_velocity()");
    return array(implementation_->node_at(node, state.q.data(), state.v.data()).v);
}
std::vector<std::int32_t> MultibodySystem::loose_nodes() const {
    std::vector<bool> held(implementation_->nodes.size());
    for (const auto& side : implementation_->element_sides)
        side.for_each_node([&](std::int32_t node) { held[static_cast<std::size_t>(node)] = true; });
    std::vector<std::int32_t> loose;
    for (std::int32_t node = 0; node < node_count(); ++node)
        if (!held[static_cast<std::size_t>(node)]) loose.push_back(node);
    return loose;
}
std::vector<std::array<std::int32_t, 2>> MultibodySystem::cables() const {
    std::vector<std::array<std::int32_t, 2>> nodes;
    for (const auto& cable : implementation_->cables) nodes.push_back(cable.nodes());
    return nodes;
}
std::int32_t MultibodySystem::node_column(std::int32_t node) const {
    implementation_->check_node(node, "node_column()");
    return implementation_->nodes[static_cast<std::size_t>(node)].column;
}
std::int32_t MultibodySystem::body_column(BodyIndex index) const {
    if (index == world_body) return -1;
    implementation_->check_body(index, "body_column()");
    return implementation_->bodies[static_cast<std::size_t>(index)].column;
}

void MultibodySystem::set_load_factor(double factor) {
    implementation_->must_be_finished();
    implementation_->load_factor = factor;
    ++implementation_->revision;
}

void MultibodySystem::set_start(const State& state) {
    implementation_->must_be_finished();
    implementation_->assembled = state;
}

std::uint64_t MultibodySystem::revision() const {
    return implementation_->revision;
}
double MultibodySystem::next_corner(double t) const {
    return implementation_->motion_corners.after(t);
}
double MultibodySystem::next_jump(double t) const {
    return implementation_->motion_corners.jump_after(t);
}
double MultibodySystem::longest_step(double t) const {
    constexpr double largest_turn = 1.0;
    const auto& self = *implementation_;
    double longest = self.motion_corners.longest_step(t);
    for (const BodyIndex index : self.uneven)
        longest = std::min(
            longest, largest_turn / std::abs(self.bodies[static_cast<std::size_t>(index)].prescribed->turning_rate(t)));
    return longest;
}
bool MultibodySystem::depends_on_time() const {
    return implementation_->motion_corners.varies();
}
bool MultibodySystem::foreseeable() const {
    return !implementation_->motion_corners.unknown();
}

const Vector3& MultibodySystem::gravity() const {
    return implementation_->gravity;
}
std::int32_t MultibodySystem::body_count() const {
    return static_cast<std::int32_t>(implementation_->bodies.size());
}
const BodyParameters& MultibodySystem::body(BodyIndex index) const {
    implementation_->check_body(index, "body()");
    if (index == world_body) throw InputError("the world has no parameters");
    return implementation_->bodies[static_cast<std::size_t>(index)].parameters;
}
std::int32_t MultibodySystem::joint_count() const {
    return static_cast<std::int32_t>(implementation_->joints.size());
}
const JointParameters& MultibodySystem::joint(std::int32_t index) const {
    if (index < 0 || index >= joint_count())
        throw InputError(fmt::format("there is no joint {}; there are {}", index, joint_count()));
    return implementation_->joints[static_cast<std::size_t>(index)].parameters;
}
BodyIndex MultibodySystem::find_body(const std::string& name) const {
    const auto& bodies = implementation_->bodies;
    const auto found =
        std::find_if(bodies.begin(), bodies.end(), [&](const auto& body) { return body.parameters.name == name; });
    return found == bodies.end() ? world_body : static_cast<BodyIndex>(found - bodies.begin());
}

Pose MultibodySystem::pose(const State& state, BodyIndex index) const {
    if (index == world_body) return {};
    implementation_->check_body(index, "pose()");
    return implementation_->pose_of(static_cast<std::size_t>(index), state);
}

Pose MultibodySystem::Implementation::pose_of(std::size_t index, const State& state) const {
    const auto& body = bodies[index];
    if (body.prescribed) return body.prescribed->pose(state.t);
    if (body.column < 0) return body.parameters.pose;
    const double* q = state.q.data() + body.position;
    return {{q[0], q[1], q[2]}, {q[3], q[4], q[5], q[6]}};
}

std::array<Vector3, 2> MultibodySystem::velocities(const State& state, BodyIndex index) const {
    if (index == world_body) return {};
    implementation_->check_body(index, "velocities()");
    const auto& body = implementation_->bodies[static_cast<std::size_t>(index)];
    if (body.prescribed) {
        mechanics::Placement place;
        body.prescribed->place(state.t, place);
        return {array(place.v), array(place.omega)};
    }
    if (body.column < 0) return {};
    const double* v = state.v.data() + body.column;
    return {Vector3{v[0], v[1], v[2]}, Vector3{v[3], v[4], v[5]}};
}

const std::vector<Shape>& MultibodySystem::shapes() const {
    return implementation_->shapes;
}
std::array<std::int32_t, 2> MultibodySystem::joint_rows(std::int32_t index) const {
    const auto& self = *implementation_;
    self.must_be_finished();
    if (index < 0 || index >= static_cast<std::int32_t>(self.joints.size()))
        throw InputError(fmt::format("there is no joint {}; there are {}", index, self.joints.size()));
    const auto& joint = self.joints[static_cast<std::size_t>(index)];
    return {joint.first_row, joint.row_count()};
}

std::int32_t MultibodySystem::n() const {
    implementation_->must_be_finished();
    return implementation_->n;
}
std::int32_t MultibodySystem::position_size() const {
    implementation_->must_be_finished();
    return implementation_->position_size;
}

State MultibodySystem::initial_state() const {
    const auto& self = *implementation_;
    self.must_be_finished();
    if (self.assembled) return *self.assembled;
    State state;
    for (const auto& body : self.bodies) {
        if (body.column < 0) continue;
        const auto& pose = body.parameters.pose;
        state.q.insert(state.q.end(), pose.position.begin(), pose.position.end());
        state.q.insert(state.q.end(), pose.orientation.begin(), pose.orientation.end());
        for (const auto* part : {&body.parameters.velocity, &body.parameters.angular_velocity})
            state.v.insert(state.v.end(), part->begin(), part->end());
    }
    for (const auto& node : self.nodes) {
        if (node.column < 0) continue;
        state.q.insert(state.q.end(), node.parameters.position.begin(), node.parameters.position.end());
        state.v.insert(state.v.end(), node.parameters.velocity.begin(), node.parameters.velocity.end());
    }
    self.append_modal_start(state);
    state.q.insert(state.q.end(), self.counted.size(), 0.0);
    self.carry_nodes(state);
    return state;
}

namespace {

/// A mass centre and a quaternion, by six increments.
void increment_pose(const double* from, const double* by, double* to) {
    const Quaterniond turned =
        mechanics::rotated({from[3], from[4], from[5], from[6]}, Eigen::Map<const Vector3d>(by + 3));
    for (int i = 0; i < 3; ++i) to[i] = from[i] + by[i];
    to[3] = turned.w();
    to[4] = turned.x();
    to[5] = turned.y();
    to[6] = turned.z();
}

void difference_of_poses(const double* a, const double* b, double* delta) {
    for (int i = 0; i < 3; ++i) delta[i] = b[i] - a[i];
    const Quaterniond first(a[3], a[4], a[5], a[6]), second(b[3], b[4], b[5], b[6]);
    Eigen::Map<Vector3d>(delta + 3) = mechanics::logarithm(first.conjugate() * second);
}

}  // namespace

void MultibodySystem::increment(const double* q, const double* delta, double* result) const {
    const auto& self = *implementation_;
    for (const auto& body : self.moving) increment_pose(q + body.position, delta + body.column, result + body.position);
    for (const auto& node : self.nodes)
        if (node.column >= 0)
            for (int i = 0; i < 3; ++i) result[node.position + i] = q[node.position + i] + delta[node.column + i];
    for (const auto& body : self.reduced) {
        increment_pose(q + body.position, delta + body.column, result + body.position);
        for (Eigen::Index a = 0; a < body.model.inertia.modes(); ++a)
            result[body.position + 7 + a] = q[body.position + 7 + a] + delta[body.column + 6 + a];
    }
    add_turns(q, delta, result);
}

void MultibodySystem::difference(const double* from, const double* to, double* delta) const {
    const auto& self = *implementation_;
    for (const auto& body : self.moving)
        difference_of_poses(from + body.position, to + body.position, delta + body.column);
    for (const auto& node : self.nodes)
        if (node.column >= 0)
            for (int i = 0; i < 3; ++i) delta[node.column + i] = to[node.position + i] - from[node.position + i];
    for (const auto& body : self.reduced) {
        difference_of_poses(from + body.position, to + body.position, delta + body.column);
        for (Eigen::Index a = 0; a < body.model.inertia.modes(); ++a)
            delta[body.column + 6 + a] = to[body.position + 7 + a] - from[body.position + 7 + a];
    }
}

void MultibodySystem::inverse_tangent(const double* delta, std::vector<DiagonalBlock3>& blocks) const {
    blocks.clear();
    const auto turn_at = [&](std::int32_t column) {
        DiagonalBlock3& block = blocks.emplace_back();
        block.first = column;
        Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(block.value) =
            mechanics::inverse_tangent_of(Eigen::Map<const Vector3d>(delta + column));
    };
    for (const auto& body : implementation_->moving) turn_at(body.column + 3);
    for (const auto& body : implementation_->reduced) turn_at(body.column + 3);
}

}  // namespace delassus
