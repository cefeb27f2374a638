// SPDX-License-Identifier: BSD-3-Clause
// Problems of rigid bodies: bodies and constraints in, H, D, E, a and b out.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "delassus/problem.hpp"
#include "generate/random.hpp"
#include "generate/rows.hpp"
#include "support/frames.hpp"

namespace delassus::generating {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The number of the world, to which fixed things belong: no columns, its frame is the world frame.
inline constexpr std::int32_t kWorld = -1;

struct Body {
    Vector3d position = Vector3d::Zero();         ///< of the mass centre, world frame
    Matrix3d orientation = Matrix3d::Identity();  ///< A: a vector s̄ of the body frame is A s̄ in the world frame
    double mass = 1.0;
    Vector3d inertia = Vector3d::Ones();           ///< principal moments J; the body frame's axes are principal
    Vector3d velocity = Vector3d::Zero();          ///< of the mass centre, world frame
    Vector3d angular_velocity = Vector3d::Zero();  ///< ω̄, body frame
};

/// Moments of a homogeneous box of the given full edge lengths.
Vector3d box_inertia(double mass, const Vector3d& edges);
/// Moments of a homogeneous sphere.
Vector3d sphere_inertia(double mass, double radius);

/// value·ratio^(index/(count − 1)), or with only_last value for all but the last, which has value·ratio.
double graded(double value, double ratio, bool only_last, std::int32_t index, std::int32_t count);

/// Adds random velocities: each component up to linear, and up to angular.
void shake(Body& body, double linear, double angular, Random& random);

struct Settings {
    double gravity = 9.81;
    double step = 0.01;
    bool world_frame = false;       ///< angular velocities of x in the world frame instead of the body frame
    bool exact_gyroscopic = false;  ///< R of the gyroscopic torque in H; body frame only
};

/// Collects bodies, then constraints between them. Constraints are blocks of rows, in the order of the calls.
class Assembly {
public:
    explicit Assembly(const Settings& settings) : settings_(settings) {}

    std::int32_t add(const Body& body);
    [[nodiscard]] const Body& body(std::int32_t number) const { return bodies_[static_cast<std::size_t>(number)]; }

    /// A contact that pushes body b off body a. point and normal (unit, from a to b) in the world frame; gap in m.
    /// mu = 0 makes one nonnegative row, otherwise a friction cone of three.
    void contact(std::int32_t a, std::int32_t b, const Vector3d& point, const Vector3d& normal, double gap, double mu);

    /// Three free rows: the point at s̄_a of body a and the one at s̄_b of body b (body frames) coincide.
    /// compliance (velocity per impulse) goes on the diagonal of E.
    void spherical_joint(std::int32_t a, const Vector3d& point_a, std::int32_t b, const Vector3d& point_b,
                         double compliance = 0.0);

    /// Two free rows: body b turns against body a only about an axis, given in both body frames.
    void hinge_axis(std::int32_t a, const Vector3d& axis_a, std::int32_t b, const Vector3d& axis_b);

    /// One row: the angular velocity of b against a about an axis (world frame, unit), plus `offset`, is u.
    void relative_rotation(std::int32_t a, std::int32_t b, const Vector3d& axis, double offset, Cone cone,
                           double compliance = 0.0);

    /// The problem; the assembly is empty afterwards.
    Problem finish(std::string name);

private:
    /// A row's coefficients of one body: of its velocity, and of its angular velocity, both in the world frame.
    struct Part {
        std::int32_t body = kWorld;
        Vector3d linear = Vector3d::Zero();
        Vector3d angular = Vector3d::Zero();
    };
    void row(const Part& first, const Part& second, double offset, double compliance);
    void put(const Part& part);
    /// The row direction · (ṗ_b − ṗ_a) for points at s_a and s_b from the mass centres (world frame).
    void point_row(std::int32_t a, const Vector3d& s_a, std::int32_t b, const Vector3d& s_b, const Vector3d& direction,
                   double offset, double compliance);

    Settings settings_;
    std::vector<Body> bodies_;
    Rows jacobian_;
    std::vector<double> offsets_;
    std::vector<double> compliances_;
    std::vector<Cone> cones_;
    bool compliant_ = false;
};

/// The rotation by the angle |v| about v (Rodrigues).
Matrix3d rotation(const Vector3d& v);

}  // namespace delassus::generating
