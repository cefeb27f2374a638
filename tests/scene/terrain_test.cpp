// SPDX-License-Identifier: BSD-3-Clause
// Scenes on terrain, against the plane and against closed forms.
#ifdef DELASSUS_HAS_FCL
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include "delassus/error.hpp"
#include "delassus/mesh_files.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::terrain_test {
namespace {

constexpr double g = 9.81;

/// Rows of a height field in YAML, from a function of x and y.
template <class Height>
std::string rows(int count_x, int count_y, double size_x, double size_y, Height&& height) {
    std::string text = "[";
    for (int row = 0; row < count_y; ++row) {
        text += row == 0 ? "[" : ", [";
        for (int column = 0; column < count_x; ++column)
            text +=
                fmt::format("{}{:.17g}", column == 0 ? "" : ", ",
                            height(size_x * (column / (count_x - 1.0) - 0.5), size_y * (0.5 - row / (count_y - 1.0))));
        text += "]";
    }
    return text + "]";
}

double flat(double, double) {
    return 0.0;
}

std::string scene_on(const std::string& ground, const std::string& bodies, const std::string& gravity = "[0, 0, -9.81]",
                     const std::string& material = "{friction: 0.3}", const std::string& more = "") {
    return "step: 0.002\nend: 1\ngravity: " + gravity + "\nmaterials: {m: " + material + "}\n" + more +
           "bodies:\n  - {name: ground, fixed: true, shapes: [{" + ground + ", material: m}]}\n" + bodies;
}

std::string ball(const std::string& more, double radius = 0.1) {
    return fmt::format("  - {{name: ball, mass: 1, shapes: [{{sphere: {{radius: {}}}, material: m}}], {}}}\n", radius,
                       more);
}

const std::string box = "  - {name: box, mass: 2, shapes: [{box: {size: [0.4, 0.3, 0.2]}, material: m}], ";

/// The farthest that a body of one scene is from itself in the other, at equal times.
double farthest_apart(const std::string& one, const std::string& other, const std::string& body) {
    Running first(parse_scene(one, "one")), second(parse_scene(other, "other"));
    const Pose start = first.pose(body);
    double farthest = 0.0;
    while (!first.simulation.finished()) {
        first.simulation.step();
        second.simulation.step();
        const Pose a = first.pose(body), b = second.pose(body);
        for (std::size_t i = 0; i < 3; ++i) farthest = std::max(farthest, std::abs(a.position[i] - b.position[i]));
        for (std::size_t i = 0; i < 4; ++i)
            farthest = std::max(farthest, std::abs(a.orientation[i] - b.orientation[i]));
    }
    const Pose end = first.pose(body);
    EXPECT_GT(std::hypot(end.position[0] - start.position[0], end.position[1] - start.position[1]), 0.3);
    return farthest;
}

const std::string triangles = "height_field: {size: [6, 6], heights: " + rows(31, 31, 6.0, 6.0, flat) + "}";

TEST(TerrainScene, ASphereRollsOverTrianglesAsOverThePlane) {
    const std::string rolling =
        ball("position: [-0.7, -0.4, 0.1], velocity: [1.2, 0.7, 0], angular_velocity: [0, 3, 1]");
    EXPECT_LT(farthest_apart(scene_on("plane: {}", rolling), scene_on(triangles, rolling), "ball"), 1e-11);
}

TEST(TerrainScene, ABoxSlidesOverTrianglesAsOverThePlane) {
    const std::string sliding =
        box + "position: [-0.7, -0.4, 0.1], velocity: [2, 1, 0], angular_velocity: [0, 0, 2]}\n";
    EXPECT_LT(farthest_apart(scene_on("plane: {}", sliding), scene_on(triangles, sliding), "box"), 1e-9);
}

TEST(TerrainScene, ABoxTumblesOverTrianglesAsOverThePlane) {
    const std::string tumbling =
        box + "position: [-0.7, -0.4, 0.5], velocity: [1, 0.5, 0], angular_velocity: [2, 1, 2]}\n";
    const std::string bouncing = "{friction: 0.3, restitution: 0.4}", down = "[0, 0, -9.81]";
    EXPECT_LT(farthest_apart(scene_on("plane: {}", tumbling, down, bouncing),
                             scene_on(triangles, tumbling, down, bouncing), "box"),
              1e-6);
}

TEST(TerrainScene, ABoxSlidesDownAnInclineOfTriangles) {
    const double angle = 0.5, mu = 0.3;
    for (const std::string& ground : {std::string("plane: {}"), triangles}) {
        Running run(parse_scene(
            scene_on(ground + ", orientation: {axis: [0, 1, 0], angle: " +
                         fmt::format("{:.17g}", angle * 180.0 / std::numbers::pi) + "}",
                     box + fmt::format("position: [{0:.17g}, 0, {1:.17g}], orientation: [{2:.17g}, 0, {3:.17g}, 0]}}\n",
                                       0.1 * std::sin(angle), 0.1 * std::cos(angle), std::cos(0.5 * angle),
                                       std::sin(0.5 * angle)),
                     "[0, 0, -9.81]", "{friction: 0.3}", "solver: {name: auto, law: coulomb, tolerance: 1.0e-10}\n"),
            "s"));
        run.finish();
        const auto v = run.velocities("box")[0];
        EXPECT_NEAR(std::hypot(v[0], v[2]), g * (std::sin(angle) - mu * std::cos(angle)), 1e-6) << ground;
        EXPECT_LT(run.simulation.totals().worst_penetration, 1e-9);
    }
}

TEST(TerrainScene, ASphereRollsAlongAVShapedValley) {
    // It touches both sides at r cos α from its axis of rotation: a = g sin β/(1 + 2/(5 cos² α)).
    const double slope = 0.8, beta = 0.3, cosine = 1.0 / std::hypot(1.0, slope);
    const std::string valley = "height_field: {size: [20, 4], heights: " +
                               rows(41, 5, 20.0, 4.0, [&](double, double y) { return slope * std::abs(y); }) + "}";
    Running run(parse_scene(
        scene_on(valley, ball(fmt::format("position: [0, 0, {:.17g}]", 0.1 / cosine)),
                 fmt::format("[{:.17g}, 0, {:.17g}]", g * std::sin(beta), -g * std::cos(beta)), "{friction: 0.9}"),
        "s"));
    run.finish();
    EXPECT_NEAR(run.velocities("ball")[0][0], g * std::sin(beta) / (1.0 + 0.4 / (cosine * cosine)), 1e-6);
    EXPECT_NEAR(run.velocities("ball")[1][1], g * std::sin(beta) / (1.0 + 0.4 / (cosine * cosine)) / (0.1 * cosine),
                1e-4);
    EXPECT_NEAR(run.pose("ball").position[1], 0.0, 1e-9);
}

// Two slopes of 45°, without friction: what slides down one of them meets the other one head on with the speed v after
// the time t₁ = v √2/g, at the middle, and goes back with v/2. Points on the two sides have names of their own, so that
// those that rest are not taken for those that strike, from whichever side the body comes.
TEST(TerrainScene, WhatSlidesIntoAValleyBouncesOffItsOtherSide) {
    const std::string ground =
        "height_field: {size: [4, 4], heights: " + rows(5, 5, 4.0, 4.0, [](double x, double) { return std::abs(x); }) +
        "}";
    constexpr double x0 = 0.7;
    const double slope = g / std::numbers::sqrt2, t1 = std::sqrt(2.0 * x0 * std::numbers::sqrt2 / slope),
                 rest = 1.0 - t1;
    const double expected = (0.5 * slope * t1 * rest - 0.5 * slope * rest * rest) / std::numbers::sqrt2;
    for (const double step : {0.002, 0.005, 0.01})
        for (const double side : {-1.0, 1.0})
            for (const bool ball : {true, false}) {
                SCOPED_TRACE(fmt::format("step {}, side {}, {}", step, side, ball ? "ball" : "box"));
                const std::string shape = ball ? "sphere: {radius: 0.3}" : "box: {size: [0.6, 0.4, 0.6]}";
                SceneOverrides overrides;
                overrides.step = step;
                Running run(parse_scene(
                    scene_on(ground,
                             fmt::format("  - {{name: body, density: 1000, shapes: [{{{}, material: m}}], position: "
                                         "[{:.17g}, 0.1, {:.17g}], orientation: {{axis: [0, 1, 0], angle: {}}}}}\n",
                                         shape, side * x0, x0 + 0.3 * std::numbers::sqrt2, 45.0 * side),
                             "[0, 0, -9.81]", "{friction: 0, restitution: 0.5}"),
                    "s", overrides));
                run.finish();
                EXPECT_NEAR(run.pose("body").position[0], side * expected, 1e-5);
                EXPECT_NEAR(run.pose("body").position[1], 0.1, 1e-9);
            }
}

TEST(TerrainScene, ASphereSwingsInAParabolaWithItsFrequency) {
    // Rolling: (7/5) (R − r) ω² = g with R the radius of curvature at the bottom.
    const double R = 2.0, r = 0.1, omega = std::sqrt(5.0 / 7.0 * g / (R - r)), period = 2.0 * std::numbers::pi / omega;
    const auto first_return = [&](int count) {
        const std::string bowl = "height_field: {size: [2, 1], heights: " +
                                 rows(count, 2, 2.0, 1.0, [&](double x, double) { return 0.5 * x * x / R; }) + "}";
        SceneOverrides overrides;
        overrides.end = 0.8 * period;
        overrides.step = 1e-3;
        const double a = 0.2;
        Running run(parse_scene(
            scene_on(bowl, ball(fmt::format("position: [{:.17g}, 0, {:.17g}]", a * (1.0 - r / R), r + 0.5 * a * a / R)),
                     "[0, 0, -9.81]", "{friction: 0.9}"),
            "s", overrides));
        // Half a period later it turns on the other side.
        double before = 0.0, turned = 0.0;
        while (!run.simulation.finished() && turned == 0.0) {
            run.simulation.step();
            const double v = run.velocities("ball")[0][0], t = run.simulation.state().t;
            if (t > 0.25 * period && v > 0.0) turned = t - 1e-3 * v / (v - before);
            before = v;
        }
        return turned;
    };
    EXPECT_NEAR(first_return(401), 0.5 * period, 0.02 * period);
}

TEST(TerrainScene, WhatFallsOnHillsComesToRestAboveThem) {
    const auto height = [](double x, double y) { return 0.15 * std::sin(2.1 * x + 0.3) * std::cos(1.7 * y); };
    std::mt19937 random(11);
    std::uniform_real_distribution<double> place(-1.2, 1.2), turn(-1.0, 1.0);
    const std::vector<std::string> kinds{
        "sphere: {radius: 0.12}", "box: {size: [0.3, 0.2, 0.16]}", "capsule: {radius: 0.08, length: 0.2}",
        "cylinder: {radius: 0.1, length: 0.2}",
        "convex: {points: [[0.15, 0, -0.05], [-0.15, 0.1, -0.05], [-0.15, -0.1, -0.05], [-0.15, 0, 0.15]]}"};
    std::string bodies;
    for (int i = 0; i < 10; ++i)
        bodies += fmt::format(
            "  - {{name: b{}, mass: 1, inertia: {{xx: 0.01, yy: 0.01, zz: 0.01}}, position: [{:.6g}, {:.6g}, {:.6g}], "
            "angular_velocity: [{:.6g}, {:.6g}, {:.6g}], shapes: [{{{}, material: m}}]}}\n",
            i, place(random), place(random), 0.6 + 0.25 * i, turn(random), turn(random), turn(random),
            kinds[static_cast<std::size_t>(i) % kinds.size()]);
    const std::string hills = "height_field: {size: [6, 6], heights: " + rows(61, 61, 6.0, 6.0, height) + "}";
    SceneOverrides overrides;
    overrides.end = 2.0;
    overrides.step = 0.002;
    Running run(
        parse_scene(scene_on(hills, bodies, "[0, 0, -9.81]", "{friction: 0.6}", "envelope: 0.03\n"), "s", overrides));
    run.finish();
    for (int i = 0; i < 10; ++i) {
        const auto at = run.pose(fmt::format("b{}", i)).position;
        EXPECT_GT(at[2], height(at[0], at[1])) << i << " at " << at[0] << ", " << at[1];
        EXPECT_LT(at[2], height(at[0], at[1]) + 1.0) << i;
    }
    EXPECT_LT(run.simulation.record().penetration, 1e-3);
}

TEST(TerrainScene, HeightsComeFromTextAndFromPictures) {
    const auto folder = std::filesystem::temp_directory_path() / fmt::format("delassus-terrain-{}", ::getpid());
    std::filesystem::create_directories(folder);
    const auto write = [&](const std::string& name, const std::string& bytes) {
        std::ofstream(folder / name, std::ios::binary) << bytes;
        return folder / name;
    };
    const Heights text = read_heights(write("a.csv", "# made by hand\n1, 2.5, -3e-1\n\n4 5\t6\n"));
    EXPECT_EQ(text.rows, 2);
    EXPECT_EQ(text.columns, 3);
    EXPECT_EQ(text.values, (std::vector<double>{1.0, 2.5, -0.3, 4.0, 5.0, 6.0}));
    const Heights picture = read_heights(
        write("b.pgm", std::string("P5\n# deep\n2 2\n65535\n") + std::string("\x00\x00\xff\xff\x80\x00\x00\x01", 8)));
    EXPECT_EQ(picture.values, (std::vector<double>{0.0, 1.0, 32768.0 / 65535.0, 1.0 / 65535.0}));
    EXPECT_EQ(read_heights(write("c.pgm", "P2 2 2 10 0 5 10 1")).values, (std::vector<double>{0.0, 0.5, 1.0, 0.1}));
    const auto refusal = [&](const std::string& bytes) -> std::string {
        try {
            static_cast<void>(read_heights(write("bad", bytes)));
        } catch (const InputError& error) {
            return error.what();
        }
        return "taken";
    };
    EXPECT_NE(refusal("1 2\n3\n").find("line 2: the row has 1 heights, those before it 2"), std::string::npos);
    EXPECT_NE(refusal("1 2\n3 x\n").find("line 2: the height 2"), std::string::npos);
    EXPECT_NE(refusal("1 2\n3 nan\n").find("line 2"), std::string::npos);
    EXPECT_NE(refusal("1;2\n").find("blanks or commas"), std::string::npos);
    EXPECT_NE(refusal("P5\n2 2\n255\nab").find("ends before"), std::string::npos);
    EXPECT_NE(refusal("P2 2 2 10 0 5 11 1").find("from 0 to 10"), std::string::npos);
    const Mesh mesh = height_field({2, 2, {1.0, 2.0, 3.0, 4.0}}, 2.0, 6.0, 10.0);
    EXPECT_EQ(mesh.vertices[0], (Vector3{-1.0, 3.0, 10.0})) << "the first row is at the largest y";
    EXPECT_EQ(mesh.vertices[3], (Vector3{1.0, -3.0, 40.0}));
    std::filesystem::remove_all(folder);
}

TEST(TerrainScene, BadTerrainIsRefusedInASentence) {
    const auto refusal = [](const std::string& shape, const std::string& fixed = "fixed: true") -> std::string {
        try {
            static_cast<void>(parse_scene("step: 1\nend: 1\nbodies:\n  - {name: b, " + fixed + ", shapes: [{" + shape +
                                              "}]}\n  - {name: c, mass: 1, shapes: [{sphere: {radius: 1}}]}\n",
                                          "s"));
        } catch (const InputError& error) {
            return error.what();
        }
        return "taken";
    };
    const auto has = [](const std::string& text, const std::string& part) {
        return testing::AssertionResult(text.find(part) != std::string::npos) << text;
    };
    EXPECT_TRUE(has(refusal("height_field: {heights: [[0, 0], [0, 0]]}"), "lacks the key \"size\""));
    EXPECT_TRUE(has(refusal("height_field: {size: [1, 1]}"), "lacks the key \"heights\""));
    EXPECT_TRUE(has(refusal("height_field: {size: [1, 1], heights: [[0, 0]]}"), "at least 2"));
    EXPECT_TRUE(has(refusal("height_field: {size: [1, 1], heights: [[0, 0], [0]]}"), "the row has 1 heights"));
    EXPECT_TRUE(has(refusal("height_field: {size: [1, -1], heights: [[0, 0], [0, 0]]}"), "positive"));
    EXPECT_TRUE(has(refusal("height_field: {size: [1, 1], file: none.csv}"), "none.csv"));
    EXPECT_TRUE(has(refusal("terrain: none.obj"), "none.obj"));
    EXPECT_TRUE(has(refusal("terrain: {scale: 2}"), "lacks the key \"file\""));
    EXPECT_TRUE(
        has(refusal("height_field: {size: [1, 1], heights: [[0, 0], [0, 0]]}", "mass: 1"), "for fixed bodies only"));
    EXPECT_TRUE(has(
        refusal("height_field: {size: [1, 1], heights: [[0, 0], [0, 0]]}", "mass: 1, inertia: {xx: 1, yy: 1, zz: 1}"),
        "fixed bodies"));
}

#ifdef DELASSUS_HAS_ASSIMP
TEST(TerrainScene, AnOpenSurfaceFromAFileIsTerrain) {
    const auto file = std::filesystem::temp_directory_path() / fmt::format("delassus-valley-{}.obj", ::getpid());
    // A channel with a flat bottom, open everywhere else.
    std::ofstream(file) << "v -4 -1 0\nv 4 -1 0\nv 4 1 0\nv -4 1 0\nv -4 -2 1\nv 4 -2 1\nv -4 2 1\nv 4 2 1\n"
                        << "f 1 2 3 4\nf 5 6 2 1\nf 4 3 8 7\n";
    Running run(
        parse_scene(scene_on("terrain: " + file.string(),
                             box + "position: [0, 0, 0.1], velocity: [1, 0, 0]}\n" + ball("position: [1, 1.5, 1.0]")),
                    "s"));
    run.finish();
    std::filesystem::remove(file);
    EXPECT_NEAR(run.pose("box").position[0], 0.5 / (0.3 * g), 2e-3) << "v²/(2 μ g)";
    EXPECT_NEAR(run.pose("box").position[2], 0.1, 1e-4);
    EXPECT_NEAR(run.pose("ball").position[2], 0.1, 1e-4) << "it rolled down to the bottom";
}
#endif

}  // namespace
}  // namespace delassus::tests::terrain_test
#endif
