// SPDX-License-Identifier: BSD-3-Clause
// Graphs of joints at random: repeated joints, closed loops, bodies that nothing lets move, motors that contradict each
// other or the joints, springs, stops, starts that do not fit.
#pragma once

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace delassus::tests {

class RandomMechanism {
public:
    explicit RandomMechanism(std::uint32_t seed) : random_(seed) {
        for (int k = 0, count = 1 + below(4); k < count; ++k) add_body(k);
        const bool all_fixed = moving_.empty();
        if (all_fixed) add_body(static_cast<int>(bodies_.size()), true);
        for (int k = 0, count = 1 + below(6); k < count; ++k) add_joint(k);
        if (chance(0.25)) add_gear();
        add_motors();
        add_forces();
    }

    /// Without head: bodies, joints and what acts in them.
    [[nodiscard]] std::string text() const {
        std::string all;
        const auto list = [&](const char* name, const std::string& items) {
            if (!items.empty()) all += fmt::format("{}:\n{}", name, items);
        };
        list("bodies", body_lines_);
        list("joints", joint_lines_);
        list("motors", motor_lines_);
        list("actuators", actuator_lines_);
        list("springs", spring_lines_);
        list("bushings", bushing_lines_);
        return all;
    }
    /// Whether it has stops, dry friction or forces with limits, which few methods take.
    [[nodiscard]] bool unilateral() const { return unilateral_; }
    /// Whether joint coordinates alone take it.
    [[nodiscard]] bool armature() const { return armature_; }

private:
    using Vector = Eigen::Vector3d;
    struct Body {
        std::string name;
        Vector position;
    };
    struct Joint {
        std::string name, kind, first, second;
        Vector point, axis;
    };

    int below(int count) { return static_cast<int>(random_() % static_cast<std::uint32_t>(count)); }
    double uniform(double from, double to) {
        return from + (to - from) * (static_cast<double>(random_()) / 4294967296.0);
    }
    bool chance(double share) { return uniform(0.0, 1.0) < share; }
    template <class T>
    const T& one_of(const std::vector<T>& all) {
        return all[static_cast<std::size_t>(below(static_cast<int>(all.size())))];
    }
    /// Of few values, so that points coincide and axes are parallel, or any.
    double coordinate() { return chance(0.7) ? one_of<double>({-1.0, -0.5, 0.0, 0.5, 1.0}) : uniform(-1.0, 1.0); }
    Vector point() { return {coordinate(), coordinate(), coordinate()}; }
    Vector direction() {
        if (chance(0.7)) return one_of<double>({-1.0, 1.0}) * Vector::Unit(below(3));
        return Vector(uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(0.1, 1.0)).normalized();
    }
    static std::string text(const Vector& v) { return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v[0], v[1], v[2]); }

    void add_body(int number, bool moves = false) {
        Body body{fmt::format("b{}", number), point()};
        std::string rest;
        if (const double kind = uniform(0.0, 1.0); !moves && kind < 0.15) {
            rest = "fixed: true";
        } else if (!moves && kind < 0.22) {
            rest = "motion: {translation: [0, 0, {sine: {amplitude: 0.1, frequency: 1}}]}";
        } else {
            // Moments of a brick that is turned by the products of inertia.
            const double mass = one_of<double>({0.001, 1.0, 2.0, 50.0}), size = uniform(0.1, 0.4);
            const Vector s = size * Vector(uniform(0.5, 1.0), uniform(0.5, 1.0), uniform(0.5, 1.0));
            const Eigen::AngleAxisd turn(uniform(0.0, 3.0), direction());
            const Vector squares = s.cwiseAbs2();
            const Eigen::Matrix3d J = turn.toRotationMatrix() *
                                      (mass * (Vector::Constant(squares.sum()) - squares)).asDiagonal() *
                                      turn.toRotationMatrix().transpose();
            rest = fmt::format(
                "mass: {}, inertia: {{xx: {:.17g}, yy: {:.17g}, zz: {:.17g}, xy: {:.17g}, xz: {:.17g}, yz: {:.17g}}}",
                mass, J(0, 0), J(1, 1), J(2, 2), J(0, 1), J(0, 2), J(1, 2));
            if (chance(0.3)) rest += ", velocity: " + text(point());
            if (chance(0.3)) rest += ", angular_velocity: " + text(point());
            moving_.push_back(body.name);
        }
        body_lines_ += fmt::format("  - {{name: {}, position: {}, {}}}\n", body.name, text(body.position), rest);
        bodies_.push_back(body);
    }

    std::string any_body() { return chance(0.3) ? "world" : one_of(bodies_).name; }

    void add_joint(int number) {
        static const std::vector<std::string> kinds = {"spherical",   "revolute",       "prismatic",
                                                       "cylindrical", "universal",      "fixed",
                                                       "planar",      "point_on_plane", "distance"};
        Joint joint{fmt::format("j{}", number), one_of(kinds), any_body(), one_of(moving_), point(), direction()};
        if (!joints_.empty() && chance(0.4)) {  // on the line of another joint, between the same bodies or others
            const Joint& other = one_of(joints_);
            joint.axis = one_of<double>({-1.0, 1.0}) * other.axis;
            joint.point = other.point + one_of<double>({0.0, 0.5, 1.0}) * other.axis;
            if (chance(0.7)) {
                joint.first = other.first;
                joint.second = other.second;
                if (joint.first != "world" && chance(0.3)) std::swap(joint.first, joint.second);
            }
            if (chance(0.5)) joint.kind = other.kind;
        }
        if (joint.first == joint.second) joint.first = "world";
        std::string line = fmt::format("name: {}, kind: {}, first: {}, second: {}, point: {}", joint.name, joint.kind,
                                       joint.first, joint.second, text(joint.point));
        if (joint.kind == "distance") {
            line += fmt::format(", second_point: {}", text(joint.point + uniform(0.2, 1.0) * direction()));
        } else if (joint.kind != "spherical" && joint.kind != "fixed") {
            line += fmt::format(", axis: {}", text(joint.axis));
        }
        if (joint.kind == "universal") line += fmt::format(", second_axis: {}", text(joint.axis.unitOrthogonal()));
        if (joint.kind == "revolute" || joint.kind == "prismatic") {
            if (chance(0.2)) line += fmt::format(", spring: {{stiffness: {}}}", uniform(1.0, 100.0));
            if (chance(0.2)) line += fmt::format(", damping: {}", uniform(0.01, 1.0));
            if (chance(0.05)) line += fmt::format(", start_rate: {}", uniform(-1.0, 1.0));
            if (chance(0.08)) {
                line += fmt::format(", lower: {}, upper: {}", uniform(-0.4, -0.1), uniform(0.1, 0.4));
                unilateral_ = true;
            }
            if (chance(0.05)) {
                line += fmt::format(", friction: {}", uniform(0.01, 1.0));
                unilateral_ = true;
            }
            if (chance(0.04)) {
                line += fmt::format(", armature: {}", uniform(0.01, 1.0));
                armature_ = true;
            }
            driveable_.push_back(joint);
        }
        joint_lines_ += fmt::format("  - {{{}}}\n", line);
        joints_.push_back(joint);
    }

    void add_gear() {
        for (const char* kind : {"revolute", "prismatic"}) {
            std::vector<std::string> names;
            for (const Joint& joint : driveable_)
                if (joint.kind == kind) names.push_back(joint.name);
            if (names.size() < 2) continue;
            joint_lines_ =
                fmt::format("  - {{name: gear, kind: gear, gear_first: {}, gear_second: {}, gear_ratio: {}}}\n",
                            names[0], names[1], one_of<double>({-2.0, -1.0, 0.5, 1.0, 3.0})) +
                joint_lines_;
            return;
        }
    }

    void add_motors() {
        for (int k = 0, count = driveable_.empty() ? 0 : below(3); k < count; ++k) {
            const double rate = one_of<double>({0.0, 0.0, 1.0, 1.0, -2.0, 0.3});
            const std::string motion =
                chance(0.6)   ? fmt::format("linear: {{rate: {}}}", rate)
                : chance(0.5) ? fmt::format("sine: {{amplitude: {}, frequency: 2}}", 0.2 * rate + 0.1)
                              : fmt::format("linear: {{start: {}, rate: {}}}", one_of<double>({0.0, 0.2}), rate);
            const bool limited = chance(0.1);
            unilateral_ = unilateral_ || limited;
            motor_lines_ +=
                fmt::format("  - {{name: m{}, joint: {}, motion: {{{}}}{}}}\n", k, one_of(driveable_).name, motion,
                            limited ? fmt::format(", speed: true, force_limit: {}", uniform(0.1, 10.0)) : "");
        }
    }

    void add_forces() {
        if (!driveable_.empty() && chance(0.2))
            actuator_lines_ +=
                fmt::format("  - {{name: servo, joint: {}, position: {}, kp: {}, kd: {}}}\n", one_of(driveable_).name,
                            uniform(-0.5, 0.5), uniform(1.0, 100.0), uniform(0.0, 2.0));
        if (chance(0.3))
            spring_lines_ += fmt::format(
                "  - {{name: coil, second: {}, first_point: [0.3, 0.2, 2], second_point: {}, stiffness: {}, "
                "damping: {}}}\n",
                one_of(moving_), text(point()), uniform(1.0, 100.0), uniform(0.0, 1.0));
        if (chance(0.15))
            bushing_lines_ += fmt::format(
                "  - {{name: pad, second: {}, point: {}, stiffness: [10, 20, 30], turn_stiffness: [1, 2, 3]}}\n",
                one_of(moving_), text(point()));
    }

    std::mt19937 random_;
    std::vector<Body> bodies_;
    std::vector<std::string> moving_;
    std::vector<Joint> joints_, driveable_;
    std::string body_lines_, joint_lines_, motor_lines_, actuator_lines_, spring_lines_, bushing_lines_;
    bool unilateral_ = false, armature_ = false;
};

}  // namespace delassus::tests
