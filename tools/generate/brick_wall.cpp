// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "generate/bodies.hpp"
#include "generate/family.hpp"

namespace delassus {
namespace generating {
namespace {

const Field<BrickWallParameters> brick_wall_fields[] = {
    {"courses", &BrickWallParameters::courses, 1, 1e5, "", "courses of bricks"},
    {"columns", &BrickWallParameters::columns, 1, 1e5, "", "whole bricks in the lowest course"},
    {"length", &BrickWallParameters::length, 1e-6, 1e6, "m", "edge of a brick along x"},
    {"width", &BrickWallParameters::width, 1e-6, 1e6, "m", "edge of a brick along y"},
    {"height", &BrickWallParameters::height, 1e-6, 1e6, "m", "edge of a brick along z"},
    {"density", &BrickWallParameters::density, 1e-3, 1e6, "kg/m^3", "of the bricks"},
    {"head_joints", &BrickWallParameters::head_joints, 0, 1, "",
     "1: four contacts on each upright face between neighbours too"},
    {"mu", &BrickWallParameters::mu, 0, 1e4, "", "friction coefficient; 0: one nonnegative row a contact"},
    {"push", &BrickWallParameters::push, -1e3, 1e3, "m/s", "velocity along y of the brick nearest the middle: a blow"},
    {"speed", &BrickWallParameters::speed, 0, 1e3, "m/s", "amplitude of random velocities"},
    {"glue", &BrickWallParameters::glue, 0, 1, "", "1: all contacts stick: free rows with b = 0"},
    {"gravity", &BrickWallParameters::gravity, 0, 1e3, "m/s^2", "along -z"},
    {"step", &BrickWallParameters::step, 1e-9, 10, "s", "time step h"},
    {"seed", &BrickWallParameters::seed, 0, kLargestSeed, "", "seed of the random velocities"},
};

// Where a brick lies along x, in half bricks: whole numbers, so that overlaps are exact.
struct Brick {
    std::int32_t from, to;
    std::int32_t body;
};

// Even courses: whole bricks. Odd courses: half a brick, whole bricks, half a brick.
std::vector<Brick> course_of(std::int32_t columns, std::int32_t course) {
    std::vector<Brick> bricks;
    const std::int32_t end = 2 * columns;
    for (std::int32_t from = 0; from < end;) {
        const std::int32_t to = course % 2 == 1 && from == 0 ? 1 : std::min(from + 2, end);
        bricks.push_back({from, to, kWorld});
        from = to;
    }
    return bricks;
}

}  // namespace

Family brick_wall_family() {
    return make_family<BrickWallParameters>("brick_wall", "a wall of bricks in running bond", brick_wall_fields,
                                            &generate_brick_wall);
}

}  // namespace generating

Problem generate_brick_wall(const BrickWallParameters& parameters) {
    using namespace generating;
    check_parameters<BrickWallParameters>("brick_wall", brick_wall_fields, parameters);
    check_count("brick_wall", "bricks", static_cast<double>(parameters.courses) * (parameters.columns + 1.0));
    Random random(parameters.seed);
    Assembly assembly({parameters.gravity, parameters.step, false, false});
    const double half = 0.5 * parameters.length;
    const double half_width = 0.5 * parameters.width;

    // Four contacts at the corners of the horizontal face from x₀ to x₁ (in half bricks) at the height z.
    const auto bed_contacts = [&](std::int32_t lower, std::int32_t upper, std::int32_t x0, std::int32_t x1, double z) {
        for (const double y : {-half_width, half_width}) {
            for (const std::int32_t x : {x0, x1}) {
                assembly.contact(lower, upper, {x * half, y, z}, Vector3d::UnitZ(), 0.0, parameters.mu);
            }
        }
    };

    std::vector<Brick> below = {{0, 2 * parameters.columns, kWorld}};  // the floor
    for (std::int32_t course = 0; course < parameters.courses; ++course) {
        const double bottom = course * parameters.height;
        std::vector<Brick> bricks = course_of(parameters.columns, course);
        auto lower = below.begin();
        for (std::size_t k = 0; k < bricks.size(); ++k) {
            Brick& brick = bricks[k];
            const Vector3d edges((brick.to - brick.from) * half, parameters.width, parameters.height);
            Body body;
            body.position = {0.5 * (brick.from + brick.to) * half, 0.0, bottom + 0.5 * parameters.height};
            body.mass = parameters.density * edges.prod();
            body.inertia = box_inertia(body.mass, edges);
            if (course == parameters.courses / 2 && k == bricks.size() / 2) body.velocity.y() = parameters.push;
            shake(body, parameters.speed, parameters.speed / parameters.length, random);
            brick.body = assembly.add(body);

            while (lower->to <= brick.from) ++lower;
            for (auto support = lower; support != below.end() && support->from < brick.to; ++support) {
                bed_contacts(support->body, brick.body, std::max(support->from, brick.from),
                             std::min(support->to, brick.to), bottom);
            }
            if (parameters.head_joints && k > 0) {
                for (const double z : {0.0, parameters.height}) {
                    for (const double y : {-half_width, half_width}) {
                        assembly.contact(bricks[k - 1].body, brick.body, {brick.from * half, y, bottom + z},
                                         Vector3d::UnitX(), 0.0, parameters.mu);
                    }
                }
            }
        }
        below = std::move(bricks);
    }
    Problem problem = assembly.finish(fmt::format("brick_wall-{}x{}", parameters.courses, parameters.columns));
    return parameters.glue ? glued(problem) : problem;
}

}  // namespace delassus
