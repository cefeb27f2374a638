// SPDX-License-Identifier: BSD-3-Clause
#include "relations/random_joints.hpp"

#include <fmt/format.h>

#include <array>
#include <string>
#include <vector>

namespace delassus::relations {
namespace {

std::vector<std::string> moving_names(const Json& scene) {
    std::vector<std::string> names;
    for (const auto& body : scene["bodies"])
        if (moves(body)) names.push_back(body["name"]);
    return names;
}

std::string any_body(Draw& draw, const Json& scene) {
    const auto& bodies = scene["bodies"];
    if (draw.chance(0.3)) return "world";
    return bodies[static_cast<std::size_t>(draw.below(static_cast<int>(bodies.size())))]["name"];
}

Point point_of(const Json& vector) {
    return {vector[0].get<double>(), vector[1].get<double>(), vector[2].get<double>()};
}

Point position_of(const Json& scene, const std::string& name) {
    const Json* body = find_named(scene, "bodies", name);
    return body ? point_of((*body)["position"]) : Point{};
}

/// a + factor b, on the grid of draws.
Point sum(const Point& a, double factor, const Point& b) {
    Point result{};
    for (std::size_t i = 0; i < 3; ++i) result[i] = Draw::rounded(a[i] + factor * b[i]);
    return result;
}

/// Across an axis.
Point across(const Point& axis) {
    const Point other = std::abs(axis[0]) > std::abs(axis[1]) ? Point{0.0, 1.0, 0.0} : Point{1.0, 0.0, 0.0};
    return {axis[1] * other[2] - axis[2] * other[1], axis[2] * other[0] - axis[0] * other[2],
            axis[0] * other[1] - axis[1] * other[0]};
}

bool has_coordinate(const std::string& kind) {
    return kind == "revolute" || kind == "prismatic";
}

void add_extras(Draw& draw, Json& joint) {
    if (draw.chance(0.2)) joint["spring"] = {{"stiffness", draw.uniform(1.0, 100.0)}};
    if (draw.chance(0.2)) joint["damping"] = draw.uniform(0.01, 1.0);
    if (draw.chance(0.05)) joint["start_rate"] = draw.uniform(-1.0, 1.0);
    if (draw.chance(0.15)) {
        if (draw.chance(0.7)) joint["lower"] = draw.uniform(-0.4, -0.05);
        if (draw.chance(0.7)) joint["upper"] = draw.uniform(0.05, 0.4);
    }
    if (draw.chance(0.08)) joint["friction"] = draw.uniform(0.01, 1.0);
}

Json make_joint(Draw& draw, std::size_t number, const std::string& kind, const std::string& first,
                const std::string& second, const Point& point, const Point& axis) {
    Json joint = {{"name", fmt::format("j{}", number)}, {"kind", kind}, {"first", first}, {"second", second}};
    joint["point"] = point;
    if (kind == "distance") {
        joint["second_point"] = sum(point, draw.uniform(0.2, 1.0), draw.direction());
    } else if (kind != "spherical" && kind != "fixed") {
        joint["axis"] = axis;
    }
    if (kind == "universal") joint["second_axis"] = across(axis);
    if (has_coordinate(kind)) add_extras(draw, joint);
    return joint;
}

std::vector<std::string> drivable(const Json& scene, const std::string& kind) {
    std::vector<std::string> names;
    if (!scene.contains("joints")) return names;
    for (const auto& joint : scene["joints"])
        if (joint["kind"] == kind) names.push_back(joint["name"]);
    return names;
}

Json random_motion(Draw& draw) {
    const double rate = draw.one_of({0.0, 1.0, 1.0, -2.0, 0.3});
    if (draw.chance(0.5)) return {{"linear", {{"rate", rate}}}};
    if (draw.chance(0.3)) return {{"ramp", {{"to", rate}, {"duration", draw.uniform(0.05, 0.3)}}}};
    return {{"sine", {{"amplitude", Draw::rounded(0.2 * rate + 0.1)}, {"frequency", 2.0}}}};
}

}  // namespace

void add_chain(Draw& draw, Json& scene) {
    std::string first = "world";
    auto& joints = scene["joints"];
    if (!joints.is_array()) joints = Json::array();
    for (const auto& name : moving_names(scene)) {
        const std::string kind = draw.one_of<std::string>(
            {"revolute", "revolute", "revolute", "spherical", "prismatic", "universal", "cylindrical", "fixed"});
        const Point here = position_of(scene, name);
        const Point there = first == "world" ? sum(here, 0.4, draw.direction()) : position_of(scene, first);
        const Point middle = sum(sum(here, -0.5, here), 0.5, there);
        joints.push_back(make_joint(draw, joints.size(), kind, first, name, middle, draw.direction()));
        first = name;
    }
}

void add_joints(Draw& draw, Json& scene, int count) {
    static const std::vector<std::string> kinds = {"spherical",   "revolute",       "revolute", "prismatic",
                                                   "cylindrical", "universal",      "fixed",    "planar",
                                                   "planar",      "point_on_plane", "distance"};
    const auto moving = moving_names(scene);
    auto& joints = scene["joints"];
    if (!joints.is_array()) joints = Json::array();
    for (int k = 0; k < count; ++k) {
        std::string kind = draw.one_of(kinds), first = any_body(draw, scene), second = draw.one_of(moving);
        Point point = sum(position_of(scene, second), draw.one_of({0.0, 0.2, 0.5}), draw.direction());
        Point axis = draw.direction();
        if (!joints.empty() && draw.chance(0.4)) {
            const Json other = joints[static_cast<std::size_t>(draw.below(static_cast<int>(joints.size())))];
            if (other.contains("axis")) axis = sum(Point{}, draw.one_of({-1.0, 1.0}), point_of(other["axis"]));
            point = sum(point_of(other["point"]), draw.one_of({0.0, 0.5, 1.0}), axis);
            if (draw.chance(0.7)) {
                first = other["first"];
                second = other["second"];
                if (first != "world" && draw.chance(0.3)) std::swap(first, second);
            }
            if (draw.chance(0.5)) kind = other["kind"];
        }
        if (first == second) first = "world";
        joints.push_back(make_joint(draw, joints.size(), kind, first, second, point, axis));
    }
}

void add_drives(Draw& draw, Json& scene) {
    for (const char* kind : {"revolute", "prismatic"}) {
        const auto names = drivable(scene, kind);
        if (names.size() >= 2 && draw.chance(0.15)) {
            scene["joints"].push_back({{"name", "gear"},
                                       {"kind", "gear"},
                                       {"gear_first", names[0]},
                                       {"gear_second", names[1]},
                                       {"gear_ratio", draw.one_of({-2.0, -1.0, 0.5, 1.0, 3.0})}});
            break;
        }
    }
    auto names = drivable(scene, "revolute");
    for (const auto& slide : drivable(scene, "prismatic")) names.push_back(slide);
    if (names.empty()) return;
    for (int k = 0, count = draw.chance(0.6) ? 0 : draw.whole(1, 2); k < count; ++k) {
        Json motor = {
            {"name", fmt::format("motor{}", k)}, {"joint", draw.one_of(names)}, {"motion", random_motion(draw)}};
        if (draw.chance(0.3)) {
            motor["speed"] = true;
            if (draw.chance(0.6)) motor["force_limit"] = draw.uniform(0.1, 10.0);
        }
        scene["motors"].push_back(motor);
    }
    if (draw.chance(0.15)) {
        Json servo = {{"name", "servo"},
                      {"joint", draw.one_of(names)},
                      {"position", draw.uniform(-0.5, 0.5)},
                      {"kp", draw.uniform(1.0, 100.0)},
                      {"kd", draw.uniform(0.0, 2.0)}};
        if (draw.chance(0.3)) servo["limit"] = draw.uniform(0.1, 10.0);
        scene["actuators"].push_back(servo);
    }
}

void add_forces(Draw& draw, Json& scene) {
    const auto moving = moving_names(scene);
    const auto at = [&](const std::string& body) {
        return sum(position_of(scene, body), draw.one_of({0.0, 0.1}), draw.direction());
    };
    if (draw.chance(0.2)) {
        const std::string second = draw.one_of(moving);
        std::string first = any_body(draw, scene);
        if (first == second) first = "world";
        Point from = first == "world" ? sum(position_of(scene, second), 0.7, draw.direction()) : at(first);
        scene["springs"].push_back({{"name", "coil"},
                                    {"first", first},
                                    {"second", second},
                                    {"first_point", from},
                                    {"second_point", at(second)},
                                    {"stiffness", draw.one_of({1.0, 20.0, 100.0, 1000.0})},
                                    {"damping", draw.chance(0.5) ? 0.0 : draw.uniform(0.0, 1.0)}});
    }
    if (draw.chance(0.07)) {
        const std::string second = draw.one_of(moving);
        const double stiffness = draw.uniform(10.0, 100.0), turn = draw.uniform(1.0, 10.0);
        // Equal along all axes: those of the world, where it is the first, do not turn with the scene.
        scene["bushings"].push_back({{"name", "pad"},
                                     {"first", "world"},
                                     {"second", second},
                                     {"point", at(second)},
                                     {"stiffness", Point{stiffness, stiffness, stiffness}},
                                     {"turn_stiffness", Point{turn, turn, turn}}});
    }
    if (draw.chance(0.07)) {
        const std::string body = draw.one_of(moving);
        scene["loads"].push_back({{"name", "push"},
                                  {"body", body},
                                  {"point", at(body)},
                                  {"follower", draw.chance(0.4)},
                                  {"force", draw.vector(draw.one_of({0.1, 2.0}))},
                                  {"torque", draw.chance(0.5) ? Point{} : draw.vector(0.1)}});
    }
}

}  // namespace delassus::relations
