// SPDX-License-Identifier: BSD-3-Clause
// Joints, motors and springs as rows (row.hpp).
#include <fmt/format.h>

#include <cmath>

#include "delassus/error.hpp"
#include "mechanics/model.hpp"

namespace delassus::mechanics {

namespace {

Vector3d unit(const Vector3& direction, const std::string& name) {
    const Vector3d v = vector(direction);
    if (!(v.norm() > 0.0) || !v.allFinite()) throw InputError(fmt::format("the axis of \"{}\" has no direction", name));
    return v.normalized();
}

/// Points and directions of the world frame in the frames of bodies.
struct Frames {
    const Placements& at;
    [[nodiscard]] Vector3d point(BodyIndex body, const Vector3d& p) const {
        return at[body].A.transpose() * (p - at[body].x);
    }
    [[nodiscard]] Vector3d direction(BodyIndex body, const Vector3d& d) const { return at[body].A.transpose() * d; }
    [[nodiscard]] Feature axis(BodyIndex body, const Vector3d& d) const {
        return Feature::axis(body, direction(body, d));
    }
    [[nodiscard]] Feature span(BodyIndex first, const Vector3d& p, BodyIndex second, const Vector3d& q) const {
        return Feature::span(first, point(first, p), second, point(second, q));
    }
};

Row product(const Feature& u, const Feature& w, double scale = 1.0) {
    Row row;
    row.u = u;
    row.w = w;
    row.scale = scale;
    return row;
}

/// The ratio as a fraction of integers below 1000, by continued fractions.
void fraction_of(double ratio, const std::string& name, double& numerator, double& denominator) {
    double before_n = 0.0, before_d = 1.0, n = 1.0, d = 0.0, rest = std::abs(ratio);
    for (int step = 0; step < 20; ++step) {
        const double whole = std::floor(rest);
        const double next_n = whole * n + before_n, next_d = whole * d + before_d;
        before_n = n;
        before_d = d;
        n = next_n;
        d = next_d;
        if (n >= 1000.0 || d >= 1000.0) break;
        if (std::abs(n / d - std::abs(ratio)) <= 1e-9 * std::abs(ratio)) {
            numerator = std::copysign(n, ratio);
            denominator = d;
            return;
        }
        rest = 1.0 / (rest - whole);
    }
    throw InputError(
        fmt::format("the ratio {} of the gear \"{}\" is not a fraction of whole numbers below 1000", ratio, name));
}

std::unique_ptr<Gear> make_gear(const JointParameters& parameters, const Placements& at,
                                const std::vector<Joint>& joints) {
    const auto geared = [&](std::int32_t index) -> const Joint* {
        const bool there = index >= 0 && index < static_cast<std::int32_t>(joints.size());
        return there ? &joints[static_cast<std::size_t>(index)] : nullptr;
    };
    const Joint *first = geared(parameters.gear_first), *second = geared(parameters.gear_second);
    const auto both = [&](JointKind kind) {
        return first && second && first->parameters.kind == kind && second->parameters.kind == kind;
    };
    const bool slides = both(JointKind::Prismatic);
    if (!slides && !both(JointKind::Revolute))
        throw InputError(
            fmt::format("the gear \"{}\" must join two revolute joints, or two prismatic ones", parameters.name));
    auto gear = std::make_unique<Gear>();
    gear->first = first->coordinate();
    gear->second = second->coordinate();
    gear->bodies = {first->parameters.first, first->parameters.second, second->parameters.first,
                    second->parameters.second};
    gear->numerator = parameters.gear_ratio;
    if (slides) return gear;
    fraction_of(parameters.gear_ratio, parameters.name, gear->numerator, gear->denominator);
    gear->offset = gear->denominator * gear->second.value(at, 0.0) - gear->numerator * gear->first.value(at, 0.0);
    return gear;
}

}  // namespace

// With z the axis and x, y normal to it:
//     point on axis     r · x = r · y = 0,  r = p_second − p_first, x and y fixed in the first body
//     parallel axes     z_first · x_second = z_first · y_second = 0
//     no turning        x_first · y_second = 0
Joint make_joint(const JointParameters& parameters, const Placements& at, const std::vector<Joint>& others) {
    Joint joint;
    joint.parameters = parameters;
    const Frames in{at};
    const BodyIndex a = parameters.first, b = parameters.second;
    const std::string& name = parameters.name;
    const Vector3d point = vector(parameters.point);
    if (parameters.kind == JointKind::Gear) {
        joint.gear = make_gear(parameters, at, others);
        return joint;
    }
    if (parameters.kind == JointKind::Distance) {
        const Feature span = in.span(a, point, b, vector(parameters.second_point));
        Row row = product(span, span);
        row.length = true;
        row.offset = (vector(parameters.second_point) - point).norm();
        if (!(row.offset > 0.0))
            throw InputError(fmt::format("the points of the distance joint \"{}\" coincide", name));
        joint.rows = {row};
        return joint;
    }
    const Vector3d z = unit(parameters.axis, name), x = normal_to(z), y = z.cross(x);
    const Feature r = in.span(a, point, b, point);
    const auto coincide = [&] {
        for (int i = 0; i < 3; ++i) joint.rows.push_back(product(r, Feature::axis(world_body, Vector3d::Unit(i))));
    };
    const auto on_axis = [&] {
        joint.rows.push_back(product(r, in.axis(a, x)));
        joint.rows.push_back(product(r, in.axis(a, y)));
    };
    const auto parallel = [&] {
        joint.rows.push_back(product(in.axis(a, z), in.axis(b, x)));
        joint.rows.push_back(product(in.axis(a, z), in.axis(b, y)));
    };
    const auto no_turning = [&] { joint.rows.push_back(product(in.axis(a, x), in.axis(b, y))); };
    switch (parameters.kind) {
        case JointKind::Spherical:
            coincide();
            break;
        case JointKind::Revolute:
            coincide();
            parallel();
            break;
        case JointKind::Cylindrical:
            on_axis();
            parallel();
            break;
        case JointKind::Prismatic:
            on_axis();
            parallel();
            no_turning();
            break;
        case JointKind::Universal: {
            const Vector3d cross = unit(parameters.second_axis, name);
            if (std::abs(cross.dot(z)) > 1e-9)
                throw InputError(
                    fmt::format("the two axes of the universal joint \"{}\" are not normal to each other", name));
            coincide();
            joint.rows.push_back(product(in.axis(a, z), in.axis(b, cross)));
            break;
        }
        case JointKind::Fixed:
            coincide();
            parallel();
            no_turning();
            break;
        case JointKind::Planar:
            joint.rows.push_back(product(r, in.axis(a, z)));
            parallel();
            break;
        case JointKind::PointOnPlane:
            joint.rows.push_back(product(r, in.axis(a, z)));
            break;
        case JointKind::Distance:
        case JointKind::Gear:
            break;
    }
    joint.turn.angle = {a,
                        b,
                        in.direction(a, z),
                        in.direction(a, x),
                        in.direction(a, y),
                        in.direction(b, z),
                        in.direction(b, x),
                        in.direction(b, y)};
    joint.slide = product(r, in.axis(a, z));
    return joint;
}

void drive_joint(Joint& joint, const MotorParameters& motor, Motions& motions) {
    const Motion& given = motor.motion;
    auto motion = std::make_unique<Motion>();
    Row row = joint.coordinate();
    if (motor.speed) {
        if (!given.integral)
            throw InputError(
                fmt::format("the motor \"{}\" needs the integral of its speed, or a force limit", motor.name));
        motion->value = given.integral;
        motion->rate = given.value;
        motion->acceleration = given.rate;
        const JointParameters& of = joint.parameters;
        row.offset = (of.kind == JointKind::Revolute ? of.turn : of.slide).start.value_or(0.0);
    } else {
        *motion = given;
    }
    row.drive = motion.get();
    joint.rows.push_back(row);
    joint.motors.push_back(motor.name);
    motions.push_back(std::move(motion));
}

RowSpring make_spring(const SpringParameters& parameters, const Placements& at) {
    const Frames in{at};
    const Vector3d first = vector(parameters.first_point), second = vector(parameters.second_point);
    const Feature span = in.span(parameters.first, first, parameters.second, second);
    RowSpring spring{product(span, span), parameters.stiffness, parameters.damping};
    spring.row.length = true;
    const double initial = (second - first).norm();
    if (!(initial > 0.0)) throw InputError(fmt::format("the points of the spring \"{}\" coincide", parameters.name));
    spring.row.offset = std::isnan(parameters.rest_length) ? initial : parameters.rest_length;
    return spring;
}

// Displacements r · e_i along the axes of the first body; rotations about x by z_first · y_second and so on, the sine
// of the angle where the other two are small. Signs: about x, y_second turns towards z_first.
std::vector<RowSpring> make_bushing(const BushingParameters& parameters, const Placements& at) {
    const Frames in{at};
    const BodyIndex a = parameters.first, b = parameters.second;
    const Vector3d point = vector(parameters.point);
    const Feature r = in.span(a, point, b, point);
    const Matrix3d& axes = at[a].A;
    std::vector<RowSpring> springs;
    for (std::size_t i = 0; i < 3; ++i) {
        const Vector3d e = axes.col(static_cast<Eigen::Index>(i));
        if (parameters.stiffness[i] > 0.0 || parameters.damping[i] > 0.0)
            springs.push_back({product(r, in.axis(a, e)), parameters.stiffness[i], parameters.damping[i]});
    }
    for (std::size_t i = 0; i < 3; ++i) {
        const Vector3d towards = axes.col(static_cast<Eigen::Index>((i + 2) % 3));
        const Vector3d turning = axes.col(static_cast<Eigen::Index>((i + 1) % 3));
        if (parameters.turn_stiffness[i] > 0.0 || parameters.turn_damping[i] > 0.0)
            springs.push_back({product(in.axis(a, towards), in.axis(b, turning)), parameters.turn_stiffness[i],
                               parameters.turn_damping[i]});
    }
    return springs;
}

}  // namespace delassus::mechanics
