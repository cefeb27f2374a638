// SPDX-License-Identifier: BSD-3-Clause
// Rooms for scenes of tests.
#pragma once

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <string>

namespace delassus::tests {

inline std::string list(const Eigen::Vector3d& v) {
    return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v[0], v[1], v[2]);
}

/// Lines of `bodies:`: the six walls wall0low to wall2high of a cube from the origin on, edge in m, of the material m.
inline std::string walls_of_cube(double edge) {
    std::string text;
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {1.0, -1.0}) {
            const Eigen::Vector3d n = side * Eigen::Vector3d::Unit(axis);
            const Eigen::Vector3d at = side > 0.0 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(-edge * n);
            const Eigen::Quaterniond q = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), n);
            text += fmt::format(
                "- {{name: wall{}{}, fixed: true, position: {}, orientation: [{:.17g}, {:.17g}, {:.17g}, {:.17g}], "
                "shapes: [{{plane: {{}}, material: m}}]}}\n",
                axis, side > 0.0 ? "low" : "high", list(at), q.w(), q.x(), q.y(), q.z());
        }
    return text;
}

}  // namespace delassus::tests
