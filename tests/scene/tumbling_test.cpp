// SPDX-License-Identifier: BSD-3-Clause
// A body that tumbles turns as it would by itself, whatever little acts on it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <string>

#include "support/scenes.hpp"

namespace delassus::tests::tumbling_test {
namespace {

Running tumbling(double h, const std::string& loads) {
    Running run(parse_scene(fmt::format("step: {}\nend: 0.6\nmaterials: {{m: {{friction: 0.5}}}}\nbodies:\n"
                                        "  - {{name: ground, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
                                        "  - {{name: b, mass: 1, inertia: {{xx: 0.001, yy: 0.0011, zz: 0.002}},\n"
                                        "     position: [0, 0, 9], angular_velocity: [20, 5, 90],\n"
                                        "     shapes: [{{box: {{size: [0.1, 0.1, 0.1]}}, material: m}}]}}\n{}",
                                        h, loads),
                            "tumbles"));
    run.finish();
    return run;
}

/// By Euler's equations for a torque in the axes of the body, with RK4 and very short steps.
Eigen::Quaterniond turned_by(const Eigen::Vector3d& torque, double end) {
    const Eigen::Vector3d inertia(0.001, 0.0011, 0.002);
    const auto change = [&](const Eigen::Vector3d& w) -> Eigen::Vector3d {
        return (torque - w.cross(inertia.cwiseProduct(w))).cwiseQuotient(inertia);
    };
    const auto turning = [](const Eigen::Vector4d& q, const Eigen::Vector3d& w) -> Eigen::Vector4d {
        return (Eigen::Quaterniond(q) * Eigen::Quaterniond(0.0, 0.5 * w[0], 0.5 * w[1], 0.5 * w[2])).coeffs();
    };
    constexpr int steps = 20000;
    const double h = end / steps;
    Eigen::Vector3d w(20.0, 5.0, 90.0);
    Eigen::Vector4d q = Eigen::Quaterniond::Identity().coeffs();
    for (int i = 0; i < steps; ++i) {
        const Eigen::Vector3d w1 = change(w), w2 = change(w + 0.5 * h * w1), w3 = change(w + 0.5 * h * w2),
                              w4 = change(w + h * w3);
        const Eigen::Vector4d q1 = turning(q, w), q2 = turning(q + 0.5 * h * q1, w + 0.5 * h * w1),
                              q3 = turning(q + 0.5 * h * q2, w + 0.5 * h * w2), q4 = turning(q + h * q3, w + h * w3);
        w += h / 6.0 * (w1 + 2.0 * w2 + 2.0 * w3 + w4);
        q += h / 6.0 * (q1 + 2.0 * q2 + 2.0 * q3 + q4);
    }
    return Eigen::Quaterniond(q).normalized();
}

double angle_between(const Running& run, const Eigen::Quaterniond& wanted) {
    const auto [w, x, y, z] = run.pose("b").orientation;
    return Eigen::Quaterniond(w, x, y, z).angularDistance(wanted);
}

TEST(Tumbling, TurnsAlikeWhateverActsOnIt) {
    for (const double h : {0.002, 0.005, 0.015}) {
        const Eigen::Quaterniond alone = turned_by(Eigen::Vector3d::Zero(), 0.6);
        EXPECT_LT(angle_between(tumbling(h, ""), alone), 1e-7) << h;
        EXPECT_LT(angle_between(tumbling(h, "loads: [{name: l, body: b, torque: [1.0e-12, 0, 0]}]\n"), alone), 1e-7)
            << h;
        const Running pushed =
            tumbling(h, "loads: [{name: l, body: b, follower: true, torque: [0.01, -0.02, 0.03]}]\n");
        EXPECT_LT(angle_between(pushed, turned_by({0.01, -0.02, 0.03}, 0.6)), 2e-3) << h;
    }
}

}  // namespace
}  // namespace delassus::tests::tumbling_test
