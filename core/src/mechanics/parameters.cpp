// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "delassus/multibody.hpp"

namespace delassus {

namespace {
constexpr double none = std::numeric_limits<double>::quiet_NaN();
}

Inertia Inertia::sphere(double mass, double radius) {
    const double moment = 0.4 * mass * radius * radius;
    return {moment, moment, moment};
}

Inertia Inertia::box(double mass, const Vector3& edges) {
    const double x = edges[0] * edges[0], y = edges[1] * edges[1], z = edges[2] * edges[2];
    return {mass / 12.0 * (y + z), mass / 12.0 * (z + x), mass / 12.0 * (x + y)};
}

Inertia Inertia::cylinder(double mass, double radius, double half_length) {
    const double across = mass * (radius * radius / 4.0 + half_length * half_length / 3.0);
    return {across, across, 0.5 * mass * radius * radius};
}

Inertia Inertia::rod(double mass, double length) {
    // A rod without thickness has no moment about its axis; a millionth of the others stands for it.
    const double across = mass * length * length / 12.0;
    return {1e-6 * across, across, across};
}

// Torsion of a rectangle a ≥ b: a b³ (1/3 − 0.21 (b/a)(1 − b⁴/(12 a⁴))) (Young and Budynas, Roark's Formulas for
// Stress and Strain, 2002, table 10.1).
BeamSection BeamSection::rectangle(double width, double height) {
    const double a = std::max(width, height), b = std::min(width, height), ratio = b / a;
    const double area = width * height;
    return {area,
            area * height * height / 12.0,
            area * width * width / 12.0,
            a * b * b * b * (1.0 / 3.0 - 0.21 * ratio * (1.0 - std::pow(ratio, 4) / 12.0)),
            5.0 / 6.0 * area,
            5.0 / 6.0 * area};
}

BeamSection BeamSection::circle(double radius) {
    const double area = std::numbers::pi * radius * radius, inertia = 0.25 * area * radius * radius;
    return {area, inertia, inertia, 2.0 * inertia, 0.9 * area, 0.9 * area};
}

JointParameters::JointParameters() : lower(none), upper(none) {}
MotorParameters::MotorParameters() : force_limit(std::numeric_limits<double>::infinity()) {}
ActuatorParameters::ActuatorParameters() : force_limit(std::numeric_limits<double>::infinity()) {}
SpringParameters::SpringParameters() : rest_length(none) {}
CableParameters::CableParameters() : rest_length(none) {}

}  // namespace delassus
