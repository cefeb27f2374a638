// SPDX-License-Identifier: BSD-3-Clause
// Balls of all masses that fly about in a box, without options, as the sequence of their impacts says: whatever the
// step, and however many impacts are in one.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "support/rooms.hpp"
#include "support/scenes.hpp"

namespace delassus::colliding_balls_test {
namespace {

using Eigen::Vector3d;
using tests::list;
using tests::Running;

struct Ball {
    double mass, radius;
    Vector3d place, velocity, spin;
};

/// In a cube with edges of 1 m from the origin on. All have one material.
struct Box {
    double friction, restitution;
    Vector3d gravity = Vector3d::Zero();
    std::vector<Ball> balls;

    struct Meeting {
        double after;
        std::size_t ball;
        std::optional<std::size_t> other;  ///< else a wall
        Vector3d wall;                     ///< its normal
    };
    /// Whose gap c + b t + a t² is gone first, while it closes.
    [[nodiscard]] static std::optional<double> closes_after(double a, double b, double c) {
        const double root = b * b - 4.0 * a * c;
        if (a == 0.0) return b < 0.0 ? std::optional(-c / b) : std::nullopt;
        if (!(root > 0.0)) return std::nullopt;
        const double t = (-b - std::sqrt(root)) / (2.0 * a);
        return t > 1e-12 ? std::optional(t) : std::nullopt;
    }
    [[nodiscard]] Meeting next(double most) const {
        Meeting first{most, 0, std::nullopt, Vector3d::Zero()};
        for (std::size_t i = 0; i < balls.size(); ++i) {
            const Ball& one = balls[i];
            for (int axis = 0; axis < 3; ++axis)
                for (const double side : {1.0, -1.0}) {
                    const Vector3d n = side * Vector3d::Unit(axis);
                    const double gap = one.place.dot(n) + (side > 0.0 ? 0.0 : 1.0) - one.radius;
                    const auto t = closes_after(0.5 * gravity.dot(n), one.velocity.dot(n), gap);
                    if (t && *t < first.after) first = {*t, i, std::nullopt, n};
                }
            for (std::size_t k = 0; k < i; ++k) {
                const Vector3d apart = one.place - balls[k].place, speed = one.velocity - balls[k].velocity;
                const double reach = one.radius + balls[k].radius;
                if (!(apart.dot(speed) < 0.0)) continue;
                const auto t =
                    closes_after(speed.squaredNorm(), 2.0 * apart.dot(speed), apart.squaredNorm() - reach * reach);
                if (t && *t < first.after) first = {*t, i, k, Vector3d::Zero()};
            }
        }
        return first;
    }
    /// Newton's law along the normal, Coulomb's across it.
    void strike(const Meeting& meeting) {
        Ball& one = balls[meeting.ball];
        Ball* other = meeting.other ? &balls[*meeting.other] : nullptr;
        const Vector3d n = other ? (one.place - other->place).normalized() : meeting.wall;
        const Vector3d arm = -one.radius * n, other_arm = other ? Vector3d(other->radius * n) : Vector3d::Zero();
        Vector3d slip = one.velocity + one.spin.cross(arm);
        if (other) slip -= other->velocity + other->spin.cross(other_arm);
        const double mobility = 1.0 / one.mass + (other ? 1.0 / other->mass : 0.0);
        const double push = -(1.0 + restitution) * slip.dot(n) / mobility;
        Vector3d impulse = -(slip - slip.dot(n) * n) / (3.5 * mobility);
        if (impulse.norm() > friction * push) impulse *= friction * push / impulse.norm();
        impulse += push * n;
        const auto act = [](Ball& ball, const Vector3d& at, const Vector3d& by) {
            ball.velocity += by / ball.mass;
            ball.spin += at.cross(by) / (0.4 * ball.mass * ball.radius * ball.radius);
        };
        act(one, arm, impulse);
        if (other) act(*other, other_arm, -impulse);
    }
    /// Returns how many impacts there were.
    int move(double time) {
        for (int impacts = 0;; ++impacts) {
            const Meeting meeting = next(time);
            const double t = meeting.after;
            for (Ball& ball : balls) {
                ball.place += t * ball.velocity + 0.5 * t * t * gravity;
                ball.velocity += t * gravity;
            }
            time -= t;
            if (!(time > 0.0)) return impacts;
            strike(meeting);
        }
    }
    [[nodiscard]] std::string scene(double h, double end) const {
        std::string text = fmt::format(
            "step: {:.17g}\nend: {}\ngravity: {}\nmaterials: {{m: {{friction: {}, restitution: {}}}}}\nbodies:\n", h,
            end, list(gravity), friction, restitution);
        text += tests::walls_of_cube(1.0);
        for (std::size_t i = 0; i < balls.size(); ++i)
            text += fmt::format(
                "- {{name: b{}, mass: {:.17g}, position: {}, velocity: {}, angular_velocity: {}, shapes: [{{sphere: "
                "{{radius: {:.17g}}}, material: m}}]}}\n",
                i, balls[i].mass, list(balls[i].place), list(balls[i].velocity), list(balls[i].spin), balls[i].radius);
        return text;
    }
};

Box box_of(std::uint32_t seed, std::size_t balls, double friction, double restitution) {
    std::mt19937 bits(seed);
    const auto between = [&](double low, double high) {
        return low + (high - low) * (static_cast<double>(bits()) / 4294967296.0);
    };
    const auto vector = [&](double most) {
        return Vector3d(between(-most, most), between(-most, most), between(-most, most));
    };
    Box box{friction, restitution, 9.81 * vector(1.0).normalized(), {}};
    while (box.balls.size() < balls) {
        const double radius = between(0.05, 0.11);
        const Vector3d place = Vector3d::Constant(0.5) + vector(0.37);
        if (std::any_of(box.balls.begin(), box.balls.end(),
                        [&](const Ball& other) { return (other.place - place).norm() < other.radius + radius + 0.01; }))
            continue;
        box.balls.push_back({std::pow(10.0, between(-2.0, 1.0)), radius, place, vector(2.5), vector(12.0)});
    }
    return box;
}

/// How far balls are at most from where the sequence of impacts has them, m, and the error that the run says it has.
struct Off {
    double distance, said;
    int impacts;
};

Off off(Box box, double h, double end, const std::string& more = "") {
    Running run(parse_scene(box.scene(h, end) + more, "test.yaml"));
    run.finish();
    Off result{0.0, run.simulation.totals().error, box.move(end)};
    for (std::size_t i = 0; i < box.balls.size(); ++i) {
        const auto& at = run.pose(fmt::format("b{}", i)).position;
        result.distance = std::max(result.distance, (Vector3d(at[0], at[1], at[2]) - box.balls[i].place).norm());
    }
    return result;
}

TEST(CollidingBalls, OneAfterAnotherInTheSameStep) {
    int impacts = 0;
    for (const auto& [friction, restitution] : {std::pair(0.3, 0.8), {0.0, 1.0}, {0.8, 0.6}})
        for (std::uint32_t seed = 0; seed < 8; ++seed)
            for (const double h : {0.01, 0.005, 0.0023}) {
                SCOPED_TRACE(fmt::format("seed {}, friction {}, step {}", seed, friction, h));
                const Off is = off(box_of(seed, 4, friction, restitution), h, 0.3);
                EXPECT_LT(is.distance, 1e-5);
                impacts += is.impacts;
            }
    EXPECT_GT(impacts, 300);
}

// What is not worth the work is told.
TEST(CollidingBalls, ManyAreRightOrTold) {
    int right = 0, all = 0;
    for (std::uint32_t seed = 0; seed < 10; ++seed)
        for (const double h : {1.0 / 60.0, 0.01, 0.005}) {
            SCOPED_TRACE(fmt::format("seed {}, step {}", seed, h));
            const Off is = off(box_of(seed, 10, 0.3, 0.9), h, 0.2);
            EXPECT_LT(is.distance, 1e-5 + is.said);
            right += is.distance < 1e-5 ? 1 : 0;
            ++all;
        }
    EXPECT_GT(right, 0.8 * all);
}

// What a step errs by is not weighed against all that moves.
TEST(CollidingBalls, AHeavyBodyFarAwayChangesNothing) {
    const std::string heavy =
        "- {name: heavy, mass: 1.0e+6, position: [0.5, 50, 50], velocity: [0, 10, 20], shapes: [{sphere: {radius: "
        "0.5}}]}\nkeep_apart: [[heavy, wall0low], [heavy, wall0high], [heavy, wall1low], [heavy, wall1high], [heavy, "
        "wall2low], [heavy, wall2high]]\n";
    for (std::uint32_t seed = 0; seed < 8; ++seed)
        for (const double h : {1.0 / 60.0, 0.01}) {
            SCOPED_TRACE(fmt::format("seed {}, step {}", seed, h));
            EXPECT_LT(off(box_of(seed, 2, 0.3, 0.9), h, 0.4, heavy).distance, 1e-5);
        }
}

}  // namespace
}  // namespace delassus::colliding_balls_test
