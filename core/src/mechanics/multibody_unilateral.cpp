// SPDX-License-Identifier: BSD-3-Clause
// Joint limits, motors with a force limit, and contacts of a multibody system.
#include <algorithm>
#include <cmath>

#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::quaternion;
using mechanics::vector;
using mechanics::Vector3d;

namespace {

/// Keys of blocks: what kind, then which one.
enum class KeyKind : std::uint64_t { Lower = 1, Upper = 2, Motor = 3, Contact = 4 };

std::uint64_t key_of(KeyKind kind, std::uint64_t first, std::uint64_t second = 0, std::uint64_t third = 0) {
    // 4 + 24 + 24 + 12 bits.
    return static_cast<std::uint64_t>(kind) << 60 | (first & 0xffffff) << 36 | (second & 0xffffff) << 12 |
           (third & 0xfff);
}

}  // namespace

bool MultibodySystem::has_unilateral() const {
    const auto& self = *implementation_;
    self.must_be_finished();
    return self.detector || !self.bounded_motors.empty() ||
           std::any_of(self.joints.begin(), self.joints.end(), [](const auto& joint) {
               return !std::isnan(joint.parameters.lower) || !std::isnan(joint.parameters.upper);
           });
}

void MultibodySystem::collect_unilateral(const State& state, double h, UnilateralRows& rows) {
    auto& self = *implementation_;
    rows.clear();
    self.place(state.q.data(), state.v.data());
    self.collect_limits(h, rows);
    self.collect_motors(state.t + h, rows);
    if (!self.detector) return;
    self.poses.resize(self.bodies.size() + self.nodes.size());
    for (std::size_t k = 0; k < self.bodies.size(); ++k) self.poses[k] = pose(state, static_cast<BodyIndex>(k));
    for (std::size_t k = 0; k < self.nodes.size(); ++k)
        self.poses[self.bodies.size() + k].position = node_position(state, static_cast<std::int32_t>(k));
    self.detector->detect(self.poses, self.envelope, self.contacts);
    self.collect_contacts(rows);
}

namespace {

/// A joint's coordinate, its speed, and its row of D.
struct Coordinate {
    double value = 0.0, speed = 0.0;
};

Coordinate coordinate_of(const mechanics::Joint& joint, const mechanics::Placements& at) {
    if (joint.parameters.kind == JointKind::Revolute) return {joint.angle.value(at), joint.angle.rate(at)};
    Coordinate result{joint.slide.value(at, 0.0), 0.0};
    const auto columns = joint.slide.columns(at);
    mechanics::RowVector gradient;
    joint.slide.gradient(at, 0.0, columns, gradient);
    for (const auto body : {joint.parameters.first, joint.parameters.second}) {
        if (at[body].column < 0) continue;
        const int first = columns.place(at[body].column);
        result.speed += gradient.segment<3>(first).dot(at[body].v) + gradient.segment<3>(first + 3).dot(at[body].omega);
    }
    return result;
}

void put_coordinate_row(const mechanics::Joint& joint, const mechanics::Placements& at, double sign,
                        UnilateralRows& rows) {
    if (joint.parameters.kind == JointKind::Revolute) {
        for (const bool second : {false, true}) {
            const auto& place = at[second ? joint.angle.second : joint.angle.first];
            if (place.column < 0) continue;
            const Vector3d coefficients = sign * joint.angle.coefficients(at, second);
            for (int i = 0; i < 3; ++i) rows.entry(place.column + 3 + i, coefficients[i]);
        }
        return;
    }
    const auto columns = joint.slide.columns(at);
    mechanics::RowVector gradient;
    joint.slide.gradient(at, 0.0, columns, gradient);
    for (int k = 0; k < columns.bodies; ++k)
        for (int i = 0; i < 6; ++i)
            rows.entry(columns.column[static_cast<std::size_t>(k)] + i, sign * gradient[6 * k + i]);
}

}  // namespace

// A stop becomes a row where the joint could reach it within two steps at its present speed, or is within a hundredth
// of a unit (m or rad) of it.
void MultibodySystem::Implementation::collect_limits(double h, UnilateralRows& rows) const {
    for (std::size_t k = 0; k < joints.size(); ++k) {
        const auto& joint = joints[k];
        const auto& limits = joint.parameters;
        if (std::isnan(limits.lower) && std::isnan(limits.upper)) continue;
        const Coordinate now = coordinate_of(joint, at);
        const double reach = 2.0 * h * std::abs(now.speed) + 0.01;
        if (!std::isnan(limits.lower) && now.value - limits.lower < reach) {
            put_coordinate_row(joint, at, 1.0, rows);
            rows.end_row(now.value - limits.lower);
            rows.end_block(Cone::nonnegative(1), key_of(KeyKind::Lower, k));
        }
        if (!std::isnan(limits.upper) && limits.upper - now.value < reach) {
            put_coordinate_row(joint, at, -1.0, rows);
            rows.end_row(limits.upper - now.value);
            rows.end_block(Cone::nonnegative(1), key_of(KeyKind::Upper, k));
        }
    }
}

void MultibodySystem::Implementation::collect_motors(double t, UnilateralRows& rows) const {
    for (std::size_t k = 0; k < bounded_motors.size(); ++k) {
        const auto& motor = bounded_motors[k];
        put_coordinate_row(joints[static_cast<std::size_t>(motor.joint)], at, 1.0, rows);
        rows.end_row(0.0, -motor.speed.value(t));
        rows.end_block(Cone::box({-motor.limit}, {motor.limit}), key_of(KeyKind::Motor, k));
    }
}

// d · ṗ = d · v + (s × d) · ω with ω = A ω̄, for a point at s from the mass centre; a node has no ω.
void MultibodySystem::Implementation::put_point(std::int32_t owner, const Vector3d& point, const Vector3d& direction,
                                                double sign, UnilateralRows& rows) const {
    const auto count = static_cast<std::int32_t>(bodies.size());
    const auto column = owner >= count ? nodes[static_cast<std::size_t>(owner - count)].column : at[owner].column;
    if (column < 0) return;
    for (int i = 0; i < 3; ++i) rows.entry(column + i, sign * direction[i]);
    if (owner >= count) return;
    const Vector3d turning = at[owner].A.transpose() * (point - at[owner].x).cross(direction);
    for (int i = 0; i < 3; ++i) rows.entry(column + 3 + i, sign * turning[i]);
}

void MultibodySystem::Implementation::collect_contacts(UnilateralRows& rows) {
    const auto number = [](std::int32_t value) { return static_cast<std::uint64_t>(value); };
    for (const auto& contact : contacts) {
        const auto material_a = shape_material[static_cast<std::size_t>(contact.shape_a)];
        const auto material_b = shape_material[static_cast<std::size_t>(contact.shape_b)];
        const auto pair = material_pairs.find(std::minmax(material_a, material_b));
        const ContactMaterial &a = materials[static_cast<std::size_t>(material_a)],
                              &b = materials[static_cast<std::size_t>(material_b)];
        const ContactMaterial material =
            pair != material_pairs.end()
                ? pair->second
                : ContactMaterial{std::sqrt(a.friction * b.friction), std::max(a.restitution, b.restitution)};
        const Vector3d normal = vector(contact.normal);
        const auto put_row = [&](const Vector3d& direction) {
            put_point(owner_of(contact.shape_a), vector(contact.point_a), direction, -1.0, rows);
            put_point(owner_of(contact.shape_b), vector(contact.point_b), direction, 1.0, rows);
        };
        const auto key = key_of(KeyKind::Contact, number(contact.shape_a), number(contact.shape_b), contact.feature);
        put_row(normal);
        rows.end_row(contact.gap);
        if (material.friction == 0.0) {
            rows.end_block(Cone::nonnegative(1), key, material.restitution);
            continue;
        }
        Vector3d t1, t2;
        tangents(normal, t1, t2);
        for (const Vector3d* tangent : {&t1, &t2}) {
            put_row(*tangent);
            rows.end_row();
        }
        rows.end_block(Cone::friction(material.friction), key, material.restitution);
    }
}

}  // namespace delassus
