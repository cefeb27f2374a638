// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/what_acts.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace delassus {

namespace {

constexpr std::size_t most_names = 4;

std::string pairs_that_touch(MultibodySystem& system, const State& bodies, double h) {
    if (!system.has_unilateral()) return {};
    UnilateralRows rows;
    system.collect_unilateral(bodies, h, rows);
    std::vector<ContactPoint>& nearest = rows.contacts();
    std::sort(nearest.begin(), nearest.end(), [](const auto& a, const auto& b) { return a.gap < b.gap; });
    const auto name = [&](std::int32_t body) {
        if (body >= system.body_count()) return fmt::format("node {}", body - system.body_count());
        return body < 0 ? std::string("world") : system.body(body).name;
    };
    std::vector<std::string> pairs;
    for (const ContactPoint& contact : nearest) {
        const auto both = system.contact_bodies(contact);
        if (both[0] < 0 && both[1] < 0) continue;
        std::string pair = fmt::format("\"{}\" and \"{}\"", name(both[0]), name(both[1]));
        if (std::find(pairs.begin(), pairs.end(), pair) == pairs.end()) pairs.push_back(std::move(pair));
        if (pairs.size() == most_names) break;
    }
    if (pairs.empty()) return {};
    return fmt::format("; bodies that touch or may, the nearest first: {}", fmt::join(pairs, ", "));
}

/// Joints that are beyond a stop, or come to it within two steps.
std::string joints_at_stops(const SceneSystem& scene, const State& bodies) {
    const MultibodySystem& system = *scene.system;
    std::vector<std::string> names;
    for (std::int32_t index = 0; index < system.joint_count() && names.size() < most_names; ++index) {
        const JointParameters& joint = system.joint(index);
        if (std::isnan(joint.lower) && std::isnan(joint.upper)) continue;
        const auto [value, rate] = system.joint_coordinate(bodies, index);
        const double reach = 2.0 * std::abs(rate) * scene.step;
        const bool below = value < joint.lower + reach;
        if (!below && !(value > joint.upper - reach)) continue;
        std::string text =
            fmt::format("\"{}\" at {:.3g} of {:.3g}", joint.name, value, below ? joint.lower : joint.upper);
        for (const MotorParameters& motor : scene.motors)
            if (motor.joint == index) text += fmt::format(" with the motor \"{}\"", motor.name);
        names.push_back(std::move(text));
    }
    return names.empty() ? std::string() : fmt::format("; joints at a stop: {}", fmt::join(names, ", "));
}

std::string fastest_body(const MultibodySystem& system, const State& bodies) {
    std::string text;
    double fastest = 0.0;
    for (BodyIndex body = 0; body < system.body_count(); ++body) {
        const auto column = system.body_column(body);
        if (column < 0) continue;
        const double* v = bodies.v.data() + column;
        if (const double speed = std::hypot(v[0], v[1], v[2]); speed > fastest) {
            fastest = speed;
            text = fmt::format("; the body that moves fastest: \"{}\", {:.3g} m/s", system.body(body).name, speed);
        }
    }
    return text;
}

}  // namespace

std::string what_acts(const SceneSystem& scene, const State& bodies) {
    MultibodySystem& system = *scene.system;
    std::string text = pairs_that_touch(system, bodies, scene.step) + joints_at_stops(scene, bodies);
    if (const auto joints = system.joints_with_rows_left_out(); !joints.empty())
        text += fmt::format("; joints that repeat or contradict others: \"{}\"", fmt::join(joints, "\", \""));
    if (text.empty()) text = fastest_body(system, bodies);
    if (!text.empty() || scene.joints.empty()) return text;
    std::vector<std::string> joints;
    for (const JointParameters& joint : scene.joints)
        if (joints.size() < most_names) joints.push_back(joint.name);
    return fmt::format("; nothing moves yet, held by {} joints, the first of them \"{}\"", scene.joints.size(),
                       fmt::join(joints, "\", \""));
}

}  // namespace delassus
