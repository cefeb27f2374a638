// SPDX-License-Identifier: BSD-3-Clause
#include "generate/bodies.hpp"

#include <array>
#include <cmath>
#include <utility>

namespace delassus::generating {

Vector3d box_inertia(double mass, const Vector3d& edges) {
    const Vector3d square = edges.cwiseAbs2();
    return mass / 12.0 * Vector3d(square.y() + square.z(), square.z() + square.x(), square.x() + square.y());
}

Vector3d sphere_inertia(double mass, double radius) {
    return Vector3d::Constant(0.4 * mass * radius * radius);
}

double graded(double value, double ratio, bool only_last, std::int32_t index, std::int32_t count) {
    if (index == count - 1) return count == 1 ? value : value * ratio;
    return only_last ? value : value * std::pow(ratio, static_cast<double>(index) / (count - 1));
}

void shake(Body& body, double linear, double angular, Random& random) {
    body.velocity += random.vector(linear);
    body.angular_velocity += random.vector(angular);
}

Matrix3d rotation(const Vector3d& v) {
    const double angle = v.norm();
    if (angle == 0.0) return Matrix3d::Identity();
    return Eigen::AngleAxisd(angle, v / angle).toRotationMatrix();
}

std::int32_t Assembly::add(const Body& body) {
    bodies_.push_back(body);
    return static_cast<std::int32_t>(bodies_.size()) - 1;
}

void Assembly::put(const Part& part) {
    if (part.body == kWorld) return;
    const std::int32_t first = 6 * part.body;
    for (int i = 0; i < 3; ++i) jacobian_.put(first + i, part.linear[i]);
    // ω = A ω̄, so that cᵀ ω = (Aᵀ c)ᵀ ω̄.
    const Vector3d angular =
        settings_.world_frame ? part.angular : Vector3d(body(part.body).orientation.transpose() * part.angular);
    for (int i = 0; i < 3; ++i) jacobian_.put(first + 3 + i, angular[i]);
}

void Assembly::row(const Part& first, const Part& second, double offset, double compliance) {
    const bool ascending = first.body < second.body;
    put(ascending ? first : second);
    put(ascending ? second : first);
    jacobian_.end_row();
    offsets_.push_back(offset);
    compliances_.push_back(compliance);
    compliant_ = compliant_ || compliance != 0.0;
}

// A point of a body at s = A s̄ from its mass centre has the velocity ṗ = v + ω × s. Along a direction d:
//     d · ṗ = d · v + (s × d) · ω
void Assembly::point_row(std::int32_t a, const Vector3d& s_a, std::int32_t b, const Vector3d& s_b,
                         const Vector3d& direction, double offset, double compliance) {
    row({b, direction, s_b.cross(direction)}, {a, -direction, -s_a.cross(direction)}, offset, compliance);
}

namespace {

/// Two unit vectors that are an orthonormal frame with a unit vector, from the axis with the smallest component. Not
/// the frames of scenes: generated problems stay what they were.
std::array<Vector3d, 2> across(const Vector3d& direction) {
    int least = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(direction[i]) < std::abs(direction[least])) least = i;
    const Vector3d first = (Vector3d::Unit(least) - direction[least] * direction).normalized();
    return {first, direction.cross(first)};
}

}  // namespace

// The gap after the step is Φ + h n · (ṗ_b − ṗ_a) ≥ 0; divided by h, u_n = n · (ṗ_b − ṗ_a) + Φ/h ≥ 0. The impulse on b
// is λ_n n + λ_t1 t₁ + λ_t2 t₂, which Dᵀ λ adds to its momentum, with the opposite sign to that of a.
void Assembly::contact(std::int32_t a, std::int32_t b, const Vector3d& point, const Vector3d& normal, double gap,
                       double mu) {
    const Vector3d s_a = a == kWorld ? point : Vector3d(point - body(a).position);
    const Vector3d s_b = b == kWorld ? point : Vector3d(point - body(b).position);
    point_row(a, s_a, b, s_b, normal, gap / settings_.step, 0.0);
    if (mu == 0.0) {
        cones_.push_back(Cone::nonnegative(1));
        return;
    }
    for (const Vector3d& tangent : across(normal)) point_row(a, s_a, b, s_b, tangent, 0.0, 0.0);
    cones_.push_back(Cone::friction(mu));
}

// C = r_b + A_b s̄_b − r_a − A_a s̄_a, three components; Ċ = ṗ_b − ṗ_a, and C + h Ċ = 0 after the step.
void Assembly::spherical_joint(std::int32_t a, const Vector3d& point_a, std::int32_t b, const Vector3d& point_b,
                               double compliance) {
    const auto arm = [&](std::int32_t number, const Vector3d& point) {
        return number == kWorld ? point : Vector3d(body(number).orientation * point);
    };
    const auto place = [&](std::int32_t number, const Vector3d& s) {
        return number == kWorld ? s : Vector3d(body(number).position + s);
    };
    const Vector3d s_a = arm(a, point_a);
    const Vector3d s_b = arm(b, point_b);
    const Vector3d error = place(b, s_b) - place(a, s_a);
    for (int i = 0; i < 3; ++i) point_row(a, s_a, b, s_b, Vector3d::Unit(i), error[i] / settings_.step, compliance);
    cones_.push_back(Cone::free(3));
}

// With the axis z fixed in a, and p, q fixed in b so that (p, q, z) is an orthonormal frame where the hinge holds:
//     C = (p · z, q · z),    d(p · z)/dt = (ω_b × p) · z + p · (ω_a × z) = (p × z) · (ω_b − ω_a)
void Assembly::hinge_axis(std::int32_t a, const Vector3d& axis_a, std::int32_t b, const Vector3d& axis_b) {
    const Vector3d z = a == kWorld ? axis_a : Vector3d(body(a).orientation * axis_a);
    for (const Vector3d& across_b : across(axis_b)) {
        const Vector3d p = b == kWorld ? across_b : Vector3d(body(b).orientation * across_b);
        const Vector3d direction = p.cross(z);
        row({b, Vector3d::Zero(), direction}, {a, Vector3d::Zero(), -direction}, p.dot(z) / settings_.step, 0.0);
    }
    cones_.push_back(Cone::free(2));
}

void Assembly::relative_rotation(std::int32_t a, std::int32_t b, const Vector3d& axis, double offset, Cone cone,
                                 double compliance) {
    row({b, Vector3d::Zero(), axis}, {a, Vector3d::Zero(), -axis}, offset, compliance);
    cones_.push_back(std::move(cone));
}

// Newton and Euler's equations, in the body frame m v̇ = m g, J ω̄˙ = f(ω̄) = −ω̄ × J ω̄. The linearised implicit Euler
// method takes the force at the end of the step to first order, f(ω⁺) ≈ f(ω) − R (ω⁺ − ω) with R = −∂f/∂ω:
//     (M + h R) ω⁺ = (M + h R) ω + h f(ω),        R = ∂(ω̄ × J ω̄)/∂ω̄ = [ω̄]× J − [J ω̄]×
// f is bilinear, so that R ω = −2 f. R is not symmetric unless the body is a sphere. Without exact_gyroscopic R is left
// out (f taken at the beginning of the step). In the world frame the inertia is A J Aᵀ and ω = A ω̄.
Problem Assembly::finish(std::string name) {
    Problem problem;
    problem.name = std::move(name);
    const double h = settings_.step;
    Rows mass;
    for (std::size_t k = 0; k < bodies_.size(); ++k) {
        const Body& body = bodies_[k];
        const auto first = static_cast<std::int32_t>(6 * k);
        for (int i = 0; i < 3; ++i) {
            mass.put(first + i, body.mass);
            mass.end_row();
        }
        const Matrix3d inertia = body.inertia.asDiagonal();
        const Vector3d spin = body.angular_velocity;
        const Vector3d torque = -spin.cross(inertia * spin);
        Matrix3d block = inertia;
        if (settings_.exact_gyroscopic) block += h * (skew(spin) * inertia - skew(inertia * spin));
        Vector3d angular = block * spin + h * torque;
        if (settings_.world_frame) {
            const Matrix3d& A = body.orientation;
            block = A * block * A.transpose();
            block = (0.5 * (block + block.transpose())).eval();  // symmetric to the last bit
            angular = (A * angular).eval();
        }
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) mass.put(first + 3 + j, block(i, j));
            mass.end_row();
        }
        const Vector3d linear = body.mass * (body.velocity - Vector3d(0.0, 0.0, h * settings_.gravity));
        problem.a.insert(problem.a.end(), linear.begin(), linear.end());
        problem.a.insert(problem.a.end(), angular.begin(), angular.end());
    }
    const auto n = static_cast<std::int32_t>(problem.a.size());
    problem.H = mass.finish(n);
    problem.D = jacobian_.finish(n);
    problem.b = std::move(offsets_);
    problem.cones = std::move(cones_);
    if (compliant_) {
        Rows compliance;
        for (std::size_t i = 0; i < compliances_.size(); ++i) {
            compliance.put(static_cast<std::int32_t>(i), compliances_[i]);
            compliance.end_row();
        }
        problem.E = compliance.finish(compliance.count());
    }
    return problem;
}

}  // namespace delassus::generating
