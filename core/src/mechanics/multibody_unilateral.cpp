// SPDX-License-Identifier: BSD-3-Clause
// Joint limits, motors with a force limit, and contacts of a multibody system.
#include <algorithm>
#include <cmath>

#include "mechanics/contact_feature.hpp"
#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::quaternion;
using mechanics::vector;
using mechanics::Vector3d;

namespace {

/// Keys of blocks: what kind, then which one.
enum class KeyKind : std::uint64_t {
    Lower = 1,
    Upper = 2,
    Motor = 3,
    Contact = 4,
    Friction = 5,
    Actuator = 6,
    MeshVertex = 7,
    MeshSide = 8,
    MeshEdges = 9
};

std::uint64_t key_of(KeyKind kind, std::uint64_t first, std::uint64_t second = 0, std::uint64_t third = 0) {
    // 4 + 24 + 24 + 12 bits.
    return static_cast<std::uint64_t>(kind) << 60 | (first & 0xffffff) << 36 | (second & 0xffffff) << 12 |
           (third & 0xfff);
}

/// A feature in 18 bits: its kind, and its first number times 2¹⁶ of the golden ratio with the second added. Of 128
/// multiples in a row any two are 287 apart or more, so that points of the same two shapes differ, but for shapes with
/// more vertices or edges than these.
std::uint64_t short_feature(std::uint32_t feature) {
    constexpr std::uint32_t golden = 0x9e37;
    const std::uint32_t kind = feature >> 30, of_a = feature >> 15 & 0x7fff, of_b = feature & 0x7fff;
    return kind << 16 | ((of_a * golden + of_b) & 0xffff);
}

/// Of what a part of another system has as its k-th.
std::uint64_t number_in(const std::vector<std::int32_t>& numbers, std::size_t k) {
    return numbers.empty() ? k : static_cast<std::uint64_t>(numbers[k]);
}

std::uint64_t key_of(const ContactPoint& contact, const std::vector<std::int32_t>& shapes) {
    // 4 + 21 + 21 + 18 bits.
    const auto shape = [&](std::int32_t number) {
        return number_in(shapes, static_cast<std::size_t>(number)) & 0x1fffff;
    };
    return static_cast<std::uint64_t>(KeyKind::Contact) << 60 | shape(contact.shape_a) << 39 |
           shape(contact.shape_b) << 18 | short_feature(contact.feature);
}

}  // namespace

std::uint64_t MultibodySystem::Implementation::mesh_contact_key(int kind, const std::array<std::uint64_t, 3>& feature) {
    constexpr std::array kinds = {KeyKind::MeshVertex, KeyKind::MeshSide, KeyKind::MeshEdges};
    return key_of(kinds[static_cast<std::size_t>(kind)], feature[0], feature[1], feature[2]);
}

bool MultibodySystem::detects_contacts() const {
    implementation_->must_be_finished();
    return implementation_->detector || implementation_->mesh_touching;
}

bool MultibodySystem::restitutes() const {
    const auto& self = *implementation_;
    std::set<std::int32_t> used(self.shape_material.begin(), self.shape_material.end());
    if (self.mesh_touching)
        for (std::size_t k = 0; k < self.materials.size(); ++k) used.insert(static_cast<std::int32_t>(k));
    return std::any_of(used.begin(), used.end(), [&](std::int32_t one) {
        return std::any_of(used.begin(), used.end(), [&](std::int32_t other) {
            const ContactMaterial between = self.material_between(one, other);
            return between.touch && between.restitution > 0.0;
        });
    });
}

bool MultibodySystem::has_unilateral() const {
    const auto& self = *implementation_;
    return self.unilateral_whole || detects_contacts() || !self.bounded_motors.empty() ||
           !self.bounded_actuators.empty() || !self.frictions.empty() ||
           std::any_of(self.joints.begin(), self.joints.end(), [](const auto& joint) {
               return !std::isnan(joint.parameters.lower) || !std::isnan(joint.parameters.upper);
           });
}

void MultibodySystem::collect_unilateral(const State& state, double h, UnilateralRows& rows) {
    auto& self = *implementation_;
    rows.clear();
    self.place_for_step(state, h);
    self.collect_limits(h, rows);
    self.collect_motors(state.t + h, rows);
    self.collect_frictions(rows);
    self.collect_actuators(state.t, h, rows);
    if (self.detector) {
        self.place_shapes(state);
        self.predict_displacements(h, state);
        rows.contacts() = self.detect(rows.team);
        if (!self.expected.empty()) self.add_expected(rows.contacts(), rows.team);
        if (!self.prescribed.empty())
            std::erase_if(rows.contacts(), [&](const ContactPoint& contact) {
                return self.point_of(self.owner_of(contact.shape_a), {}).column < 0 &&
                       self.point_of(self.owner_of(contact.shape_b), {}).column < 0;
            });
        self.collect_contacts(h, rows);
    }
    if (self.mesh_touching) self.collect_mesh_contacts(state, h, rows);
}

bool MultibodySystem::collect_contact(const SmoothMotion& motion, double time, const ContactPoint& contact,
                                      UnilateralRows& rows) {
    constexpr double same_side = 0.5;  // cosine
    auto& self = *implementation_;
    rows.clear();
    if (!self.detector) return false;
    const auto place = [&](std::int32_t shape, Pose& pose) {
        const std::int32_t owner = self.owner_of(shape);
        if (owner == world_body) return true;
        if (owner >= static_cast<std::int32_t>(self.bodies.size())) return false;
        auto& at = self.at[owner];
        const auto& body = self.bodies[static_cast<std::size_t>(owner)];
        if (body.column >= 0) {
            const auto column = static_cast<std::size_t>(body.column);
            const auto way = [&](std::size_t i) { return motion.way(column + i, time); };
            const double* q = motion.begin.q.data() + body.position;
            const mechanics::Quaterniond turned =
                mechanics::Quaterniond(q[3], q[4], q[5], q[6]) * mechanics::exponential({way(3), way(4), way(5)});
            at.x = Vector3d(q[0] + way(0), q[1] + way(1), q[2] + way(2));
            at.A = turned.toRotationMatrix();
            pose = {mechanics::array(at.x), {turned.w(), turned.x(), turned.y(), turned.z()}};
        } else if (body.prescribed) {
            body.prescribed->place(motion.begin.t + time, at);
            self.at_state[owner] = at;
            pose = body.prescribed->pose(motion.begin.t + time);
        } else {
            pose = body.parameters.pose;
        }
        return true;
    };
    Pose pose_a, pose_b;
    if (!place(contact.shape_a, pose_a) || !place(contact.shape_b, pose_b)) return false;
    auto& points = rows.contacts();
    self.detector->detect_pair(contact.shape_a, contact.shape_b, pose_a, pose_b, self.envelope, points);
    std::erase_if(points, [&](const ContactPoint& point) {
        return point.feature != contact.feature || !(vector(point.normal).dot(vector(contact.normal)) > same_side);
    });
    if (points.size() != 1) return false;
    self.collect_contacts(motion.h, rows);
    return true;
}

void MultibodySystem::Implementation::place_for_step(const State& state, double h) {
    place(state);
    if (!prescribed.empty()) at_state = at;
    for (const auto index : prescribed)
        bodies[static_cast<std::size_t>(index)].prescribed->place_for_step(state.t, h, at[index]);
}

void MultibodySystem::Implementation::place_shapes(const State& state) {
    for (const auto& body : moving) {
        const double* q = state.q.data() + body.position;
        poses[static_cast<std::size_t>(body.body)] = {{q[0], q[1], q[2]}, {q[3], q[4], q[5], q[6]}};
    }
    for (const auto index : prescribed)
        poses[static_cast<std::size_t>(index)] = pose_of(static_cast<std::size_t>(index), state);
    for (std::size_t k = 0; k < nodes.size(); ++k)
        if (nodes[k].touches)
            poses[bodies.size() + k].position =
                mechanics::array(node_at(static_cast<std::int32_t>(k), state.q.data(), state.v.data()).x);
}

// At the velocities of the beginning and those that weight adds: other forces are small over a step, or meet a contact
// of the next one.
void MultibodySystem::Implementation::predict_displacements(double h, const State& state) {
    displacements.resize(poses.size());
    const Vector3d fall = h * load_factor * vector(gravity);
    const auto put = [&](BodyIndex body, const Vector3d& added) {
        const auto& place = at[body];
        displacements[static_cast<std::size_t>(body)] = {mechanics::array(h * (place.v + added)),
                                                         mechanics::array(h * (place.A * place.omega)),
                                                         mechanics::array(h * added)};
    };
    for (const auto& body : moving) put(body.body, fall);
    for (const auto index : prescribed) put(index, Vector3d::Zero());
    for (std::size_t k = 0; k < nodes.size(); ++k)
        if (nodes[k].touches && nodes[k].moves()) {
            const auto node = node_at(static_cast<std::int32_t>(k), state.q.data(), state.v.data());
            displacements[bodies.size() + k].translation = mechanics::array(h * (node.v + fall));
            displacements[bodies.size() + k].fall = mechanics::array(h * fall);
        }
}

namespace {

void put_coordinate_row(const mechanics::Row& coordinate, const mechanics::Placements& at, double sign,
                        UnilateralRows& rows) {
    const auto columns = coordinate.columns(at);
    mechanics::RowVector gradient;
    coordinate.gradient(at, columns, gradient);
    const int first = coordinate.angle ? 3 : 0;
    for (int k = 0; k < columns.bodies; ++k) {
        const Eigen::Matrix<double, 6, 1> part = sign * gradient.segment<6>(6 * k);
        rows.entries(columns.column[static_cast<std::size_t>(k)] + first,
                     {part.data() + first, static_cast<std::size_t>(6 - first)});
    }
}

}  // namespace

// A stop becomes a row where the joint could reach it within two steps at its present speed, or is within a hundredth
// of a unit (m or rad) of it.
void MultibodySystem::Implementation::collect_limits(double h, UnilateralRows& rows) const {
    for (std::size_t k = 0; k < joints.size(); ++k) {
        const auto& joint = joints[k];
        const auto& limits = joint.parameters;
        if (std::isnan(limits.lower) && std::isnan(limits.upper)) continue;
        const auto& coordinate = joint.coordinate();
        const double now = coordinate.value(at, 0.0), rate = coordinate.rate(at, 0.0);
        const double reach = 2.0 * h * std::abs(rate_of(coordinate)) + 0.01;
        const auto put = [&](double sign, double gap, KeyKind kind) {
            if (!(gap < reach)) return;
            put_coordinate_row(coordinate, at, sign, rows);
            rows.end_row(gap, sign * rate);
            rows.end_block(Cone::nonnegative(1), key_of(kind, number_in(numbers.joints, k)));
        };
        put(1.0, now - limits.lower, KeyKind::Lower);
        put(-1.0, limits.upper - now, KeyKind::Upper);
    }
}

// A box row without a prescribed speed: u = 0 wherever a force within the bounds can hold the coordinate still.
void MultibodySystem::Implementation::collect_frictions(UnilateralRows& rows) const {
    for (const auto& [index, turns, box] : frictions) {
        const auto& joint = joints[static_cast<std::size_t>(index)];
        const auto& coordinate = turns ? joint.turn : joint.slide;
        put_coordinate_row(coordinate, at, 1.0, rows);
        rows.end_row(0.0, coordinate.rate(at, 0.0));
        rows.end_block(
            box, key_of(KeyKind::Friction, number_in(numbers.joints, static_cast<std::size_t>(index)), turns ? 1 : 0));
    }
}

void MultibodySystem::Implementation::collect_motors(double t, UnilateralRows& rows) const {
    for (std::size_t k = 0; k < bounded_motors.size(); ++k) {
        const auto& motor = bounded_motors[k];
        const auto& joint = joints[static_cast<std::size_t>(motor.joint)];
        put_coordinate_row(joint.coordinate(), at, 1.0, rows);
        rows.end_row(0.0, joint.coordinate().rate(at, 0.0) - motor.speed.value(t));
        rows.end_block(motor.box, key_of(KeyKind::Motor, number_in(numbers.motors, k)));
    }
}

// The force at the end of the step is τ = kp (p − c − h ċ) + kd (s − ċ) = r − g ċ with p and s at that time,
// r = kp (p − c) + kd s and g = kd + h kp, where c is the coordinate now. As a row it is ċ + τ/g − r/g = 0, with the
// compliance 1/g, and τ in the box of the limit: a servo at its limit gives just that.
void MultibodySystem::Implementation::collect_actuators(double t, double h, UnilateralRows& rows) const {
    for (std::size_t k = 0; k < bounded_actuators.size(); ++k) {
        const auto& one = bounded_actuators[k];
        const auto& joint = joints[static_cast<std::size_t>(one.joint)];
        const auto& coordinate = joint.coordinate();
        const double value = coordinate.value(at, 0.0);
        const double force = one.kp * (one.position.value(t + h) - value) + one.kd * one.speed.value(t + h);
        const double gain = one.kd + h * one.kp;
        put_coordinate_row(coordinate, at, 1.0, rows);
        rows.end_row(0.0, coordinate.rate(at, 0.0) - force / gain);
        rows.end_block(one.box, key_of(KeyKind::Actuator, number_in(numbers.actuators, k)), 0.0, 1.0 / gain);
    }
}

// d · ṗ = d · v + (s × d) · ω with ω = A ω̄, for a point at s from the mass centre; a node has no ω. For a node of a
// reduced body, which is at s = A u, there is d · A Φ ṡ more.
MultibodySystem::Implementation::PointOfOwner MultibodySystem::Implementation::point_of(std::int32_t owner,
                                                                                        const Vector3d& point) const {
    const auto count = static_cast<std::int32_t>(bodies.size());
    if (owner >= count) {
        const auto& node = nodes[static_cast<std::size_t>(owner - count)];
        if (node.reduced < 0)
            return {node.column, nullptr, Vector3d::Zero(), vector(poses[static_cast<std::size_t>(owner)].position)};
        const auto& body = reduced[static_cast<std::size_t>(node.reduced)];
        const auto& place = modal_at[static_cast<std::size_t>(node.reduced)];
        const Eigen::Index local = owner - count - body.first_node;
        const auto shape = body.model.shapes.middleRows(3 * local, 3);
        return {place.column, &place.A, place.A * (body.model.places.col(local) + shape * place.s),
                place.x,      &body,    local};
    }
    const auto& place = at[owner];
    return {place.column, &place.A, point - place.x, place.x};
}

// In a step of length h the velocity v of a body takes its centre c along a straight line, and its spin ω turns the
// rest about c. So a surface whose motion is prescribed goes there along the chord, from its place below c to that at
// the end of the step, and beside it as the body would that rides on it: what rests on the surface has D v + rate = 0
// at all its points, and stays where it is on it. Along the tangent it would be carried outwards by r (ω h)²/2 in each
// step. Rows at a state that has moved on along v for the time s since the step began are those of the place c + ½ a s²
// where a body that rides is by then: along the tangent c is too far out, and what rests would creep by r (ω h)²/4. For
// the same reason the surface is taken at the point of the body, which may be below it by then.
//
// A round surface does not change as it turns about its axis, whatever lies on it: there c is the point of the axis
// below, and the surface has the speed of that point and what the spin adds to it. With the chord of a point of the
// surface it would withdraw by r (ω h)²/2 in each step, and a board would sink into the rollers that carry it.
std::optional<Vector3d> MultibodySystem::Implementation::axis_below(std::int32_t number, const Vector3d& point,
                                                                    const Vector3d& outward) const {
    if (number >= static_cast<std::int32_t>(shapes.size())) return std::nullopt;
    const Shape& shape = shapes[static_cast<std::size_t>(number)];
    if (shape.kind != ShapeKind::Sphere && shape.kind != ShapeKind::Capsule && shape.kind != ShapeKind::Cylinder)
        return std::nullopt;
    if (shape.kind == ShapeKind::Cylinder && shape.body != world_body) {
        constexpr double most_tilt = 1e-3;
        const auto& [w, x, y, z] = shape.pose.orientation;
        const Vector3d axis = at[shape.body].A * (mechanics::Quaterniond(w, x, y, z) * Vector3d::UnitZ());
        if (std::abs(axis.dot(outward)) > most_tilt) return std::nullopt;
    }
    return point - shape.size[0] * outward;
}

Vector3d MultibodySystem::Implementation::prescribed_velocity(std::int32_t owner, const Vector3d& point,
                                                              const Vector3d& center, double since, double h) const {
    if (owner >= static_cast<std::int32_t>(bodies.size()) || !at[owner].prescribed()) return Vector3d::Zero();
    const auto& place = at[owner];
    const auto& now = at_state[owner];
    const Vector3d spin = place.A * place.omega;
    Vector3d arm = center - place.x;
    if (since > 0.0) {
        const Vector3d pull = 2.0 / h * (place.v - now.v), spin_up = 2.0 / h * (spin - now.A * now.omega);
        arm += 0.5 * since * since * (pull + spin_up.cross(arm) + spin.cross(spin.cross(arm)));
    }
    const mechanics::Quaterniond turn = mechanics::exponential(h * spin);
    const Vector3d across = turn.vec().cross(arm);
    return place.v + 2.0 / h * (turn.w() * across + turn.vec().cross(across)) + spin.cross(point - center);
}

Vector3d MultibodySystem::Implementation::prescribed_velocity_now(std::int32_t owner, const Vector3d& point) const {
    if (owner >= static_cast<std::int32_t>(bodies.size()) || !at_state[owner].prescribed()) return Vector3d::Zero();
    const auto& place = at_state[owner];
    return place.v + (place.A * place.omega).cross(point - place.x);
}

std::optional<Vector3> MultibodySystem::prescribed_velocity(const ContactPoint& contact, double begin, double t) const {
    const auto& self = *implementation_;
    const auto velocity = [&](std::int32_t shape, const Vector3& point) -> Vector3d {
        const auto owner = static_cast<std::size_t>(self.owner_of(shape));
        if (owner >= self.bodies.size() || !self.bodies[owner].prescribed) return Vector3d::Zero();
        const auto& motion = *self.bodies[owner].prescribed;
        mechanics::Placement place;
        motion.place(t, place);
        const Vector3d origin = contact.on_the_way ? vector(motion.pose(begin).position) : place.x;
        return place.v + (place.A * place.omega).cross(vector(point) - origin);
    };
    return mechanics::array(velocity(contact.shape_b, contact.point_b) - velocity(contact.shape_a, contact.point_a));
}

// Inline in the loop over contacts, which calls it six times for each.
inline void MultibodySystem::Implementation::PointOfOwner::put(const Vector3d& direction, double sign,
                                                               UnilateralRows& rows) const {
    if (column < 0) return;
    if (!A) return rows.entries(column, std::array{sign * direction[0], sign * direction[1], sign * direction[2]});
    const Vector3d turning = A->transpose() * arm.cross(direction);
    rows.entries(column, std::array{sign * direction[0], sign * direction[1], sign * direction[2], sign * turning[0],
                                    sign * turning[1], sign * turning[2]});
    if (!reduced) return;
    const Vector3d turned = sign * (A->transpose() * direction);
    for (Eigen::Index a = 0; a < reduced->model.inertia.modes(); ++a)
        rows.entry(column + 6 + static_cast<std::int32_t>(a),
                   reduced->model.shapes.col(a).segment<3>(3 * node).dot(turned));
}

ContactMaterial MultibodySystem::Implementation::material_between(std::int32_t first, std::int32_t second) const {
    const auto pair = material_pairs.find(std::minmax(first, second));
    if (pair != material_pairs.end()) return pair->second;
    const ContactMaterial &a = materials[static_cast<std::size_t>(first)],
                          &b = materials[static_cast<std::size_t>(second)];
    return {std::sqrt(a.friction * b.friction), std::max(a.restitution, b.restitution)};
}

std::array<std::int32_t, 2> MultibodySystem::contact_bodies(const ContactPoint& contact) const {
    return {implementation_->owner_of(contact.shape_a), implementation_->owner_of(contact.shape_b)};
}

void MultibodySystem::Implementation::collect_contacts(double h, UnilateralRows& rows) {
    std::int32_t last_a = -1, last_b = -1;  // neighbouring contacts are of the same materials as a rule
    ContactMaterial material;
    for (const auto& contact : rows.contacts()) {
        const auto material_a = shape_material[static_cast<std::size_t>(contact.shape_a)];
        const auto material_b = shape_material[static_cast<std::size_t>(contact.shape_b)];
        if (material_a != last_a || material_b != last_b) material = material_between(material_a, material_b);
        last_a = material_a;
        last_b = material_b;
        const Vector3d normal = vector(contact.normal);
        const std::int32_t owner_a = owner_of(contact.shape_a), owner_b = owner_of(contact.shape_b);
        const PointOfOwner a = point_of(owner_a, vector(contact.point_a));
        const PointOfOwner b = point_of(owner_b, vector(contact.point_b));
        Vector3d prescribed_speed = Vector3d::Zero(), speed_now = Vector3d::Zero();
        if (!prescribed.empty()) {
            const Vector3d on_a = vector(contact.point_a), on_b = vector(contact.point_b);
            const auto mean_of = [&](std::int32_t owner, std::int32_t shape, const Vector3d& own,
                                     const Vector3d& outward, const Vector3d& others, const PointOfOwner& other) {
                const auto axis = axis_below(shape, own, outward);
                return prescribed_velocity(owner, axis ? own : others, axis.value_or(other.center), rows.since(), h);
            };
            prescribed_speed = mean_of(owner_b, contact.shape_b, on_b, -normal, on_a, a) -
                               mean_of(owner_a, contact.shape_a, on_a, normal, on_b, b);
            speed_now = prescribed_velocity_now(owner_b, on_b) - prescribed_velocity_now(owner_a, on_a);
        }
        const auto put_row = [&](const Vector3d& direction, double gap) {
            a.put(direction, -1.0, rows);
            b.put(direction, 1.0, rows);
            rows.end_row(gap, direction.dot(prescribed_speed), direction.dot(speed_now));
        };
        const auto key = key_of(contact, numbers.shapes);
        put_row(normal, contact.gap);
        if (material.friction == 0.0 && leaves_out) {
            rows.end_block(Cone::nonnegative(1), key, material.restitution);
            continue;
        }
        const mechanics::Matrix3d frame = contact_frame(normal);
        for (int k = 1; k < 3; ++k) put_row(frame.col(k), 0.0);
        rows.end_block(Cone::friction(material.friction), key, material.restitution);
    }
}

}  // namespace delassus
