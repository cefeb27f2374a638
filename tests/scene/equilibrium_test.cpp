// SPDX-License-Identifier: BSD-3-Clause
// Static equilibrium by load stepping, against closed forms.
#include "delassus/equilibrium.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "delassus/error.hpp"
#include "delassus/timestepper.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::equilibrium_test {
namespace {

constexpr double g = 9.81;

/// A scene's only system and its equilibrium.
struct Found {
    Scene scene;
    Equilibrium equilibrium;

    explicit Found(const std::string& yaml)
        : scene(parse_scene("step: 0.001\nend: 0.1\n" + yaml, "s")),
          equilibrium(find_equilibrium(scene.systems.at(0), registry())) {}
    [[nodiscard]] const MultibodySystem& system() const { return *scene.systems.at(0).system; }
    [[nodiscard]] Vector3 body(const std::string& name) const {
        return system().pose(equilibrium.state, system().find_body(name)).position;
    }
    [[nodiscard]] Vector3 node(std::int32_t number) const { return system().node_position(equilibrium.state, number); }
};

std::string refusal(const std::string& yaml) {
    try {
        Found found(yaml);
    } catch (const Error& error) {
        return error.what();
    }
    return "found";
}

testing::AssertionResult has(const std::string& text, const std::string& part) {
    return testing::AssertionResult(text.find(part) != std::string::npos) << text;
}

TEST(Equilibrium, AMassHangsFromItsSpring) {
    const Found found(
        "bodies: [{name: bob, mass: 2, inertia: {xx: 1, yy: 1, zz: 1}, position: [0.3, 0.2, -1]}]\n"
        "springs: [{name: s, second: bob, first_point: [0, 0, 0], stiffness: 100, rest_length: 1}]\n");
    const auto at = found.body("bob");
    EXPECT_NEAR(at[0], 0.0, 1e-9);
    EXPECT_NEAR(at[1], 0.0, 1e-9);
    EXPECT_NEAR(at[2], -1.0 - 2.0 * g / 100.0, 1e-10);
    EXPECT_EQ(found.equilibrium.load_steps.size(), 10U);
    EXPECT_DOUBLE_EQ(found.equilibrium.load_steps[4].load, 0.5);
    EXPECT_LT(found.equilibrium.load_steps.back().residual, 1e-9);
    const double stretch = 2.0 * g / 100.0;
    EXPECT_NEAR(found.equilibrium.load_steps.back().energy, 50.0 * stretch * stretch - 2.0 * g * (1.0 + stretch), 1e-8);
    EXPECT_EQ(found.equilibrium.smallest_eigenvalue, 0.0) << "the mass turns freely about its own centre";
}

/// H of a chain of links whose lengths follow from their pull, so that it spans a width. Link i leans by
/// tan θ_i = w (i − (n − 1)/2)/H, the mean of the forces at its ends.
template <class Length>
double horizontal_pull(int n, double width, double w, Length&& length) {
    double low = 1e-6, high = 1e6;
    for (int i = 0; i < 200; ++i) {
        const double H = std::sqrt(low * high);
        double sum = 0.0;
        for (int k = 0; k < n; ++k) {
            const double slope = w * (k - 0.5 * (n - 1)) / H;
            sum += length(H * std::hypot(1.0, slope)) / std::hypot(1.0, slope);
        }
        // Wider with more pull.
        (sum > width ? high : low) = H;
    }
    return std::sqrt(low * high);
}

TEST(Equilibrium, AChainOfLinksIsTheDiscreteCatenary) {
    // Twenty links of 0.1 m, held as a V of 36.87°, come down to the catenary.
    constexpr int n = 20;
    const double l = 0.1, cosine = 0.8, sine = 0.6, mass = 0.5, width = n * l * cosine;
    std::string bodies = "bodies:\n", joints = "joints:\n";
    std::array<double, 2> at{0.0, 0.0};
    for (int k = 0; k < n; ++k) {
        const double down = k < n / 2 ? -1.0 : 1.0, angle = std::asin(sine) * 180.0 / std::numbers::pi;
        bodies += fmt::format(
            "  - {{name: link_{}, mass: {}, inertia: {{xx: 1.0e-4, yy: 4.0e-4, zz: 4.0e-4}}, position: [{:.17g}, 0, "
            "{:.17g}], orientation: {{axis: [0, 1, 0], angle: {:.17g}}}}}\n",
            k, mass, at[0] + 0.5 * l * cosine, at[1] + down * 0.5 * l * sine, -down * angle);
        joints += fmt::format(
            "  - {{name: j{}, kind: spherical, first: {}, second: link_{}, point: [{:.17g}, 0, {:.17g}]}}\n", k,
            k == 0 ? std::string("world") : fmt::format("link_{}", k - 1), k, at[0], at[1]);
        at = {at[0] + l * cosine, at[1] + down * l * sine};
    }
    joints += fmt::format("  - {{name: end, kind: spherical, first: link_{}, second: world, point: [{:.17g}, 0, 0]}}\n",
                          n - 1, at[0]);
    const Found found(bodies + joints);
    const double H = horizontal_pull(n, width, mass * g, [&](double) { return l; });
    double x = 0.0, z = 0.0, sag = 0.0;
    for (int k = 0; k < n; ++k) {
        const double slope = mass * g * (k - 0.5 * (n - 1)) / H, c = 1.0 / std::hypot(1.0, slope);
        const auto middle = found.body(fmt::format("link_{}", k));
        EXPECT_NEAR(middle[0], x + 0.5 * l * c, 1e-8) << k;
        EXPECT_NEAR(middle[2], z + 0.5 * l * c * slope, 1e-8) << k;
        x += l * c;
        z += l * c * slope;
        sag = std::min(sag, z);
    }
    // The continuous catenary of the same length: width = 2 a asinh(L/(2a)), sag = a (cosh(width/(2a)) − 1).
    double low = 0.1, high = 10.0;
    for (int i = 0; i < 100; ++i) {
        const double a = 0.5 * (low + high);
        (2.0 * a * std::asinh(n * l / (2.0 * a)) > width ? high : low) = a;
    }
    EXPECT_NEAR(sag, -low * (std::cosh(width / (2.0 * low)) - 1.0), 0.01 * std::abs(sag));
    EXPECT_LT(found.equilibrium.load_steps.back().residual, 1e-7);
    EXPECT_NEAR(found.equilibrium.smallest_eigenvalue, 0.0, 1e-6) << "links spin freely about their own axes";
}

TEST(Equilibrium, ACableThatIsStretchedStraightSags) {
    // Straight it has no stiffness across; under its weight it is the elastic catenary of its elements.
    constexpr int n = 16;
    const double l = 0.25, young = 1e8, area = 1e-5, weight = 4000.0 * area * l * g;
    std::string yaml = "nodes:\n";
    for (int k = 0; k <= n; ++k)
        yaml += fmt::format("  - {{name: n{}, fixed: {}, position: [{:.17g}, 0, 0]}}\n", k, k == 0 || k == n, k * l);
    yaml += "cables:\n";
    for (int k = 0; k < n; ++k)
        yaml += fmt::format("  - {{name: c{}, nodes: [n{}, n{}], young: {}, area: {}, density: 4000}}\n", k, k, k + 1,
                            young, area);
    const Found found(yaml);
    const auto length = [&](double pull) { return l * (1.0 + pull / (young * area)); };
    const double H = horizontal_pull(n, n * l, weight, length);
    double x = 0.0, z = 0.0;
    for (int k = 0; k < n; ++k) {
        EXPECT_NEAR(found.node(k)[0], x, 1e-8) << k;
        EXPECT_NEAR(found.node(k)[2], z, 1e-8) << k;
        const double slope = weight * (k - 0.5 * (n - 1)) / H, c = 1.0 / std::hypot(1.0, slope);
        x += length(H / c) * c;
        z += length(H / c) * c * slope;
    }
    EXPECT_LT(found.node(n / 2)[2], -0.1);
    EXPECT_GT(found.equilibrium.smallest_eigenvalue, 0.0);
}

/// A cantilever of length 1 along x under a force P at its end.
std::string cantilever(int elements, double EI, double P) {
    const double young = 1e9, inertia = EI / young;
    return fmt::format(
        "gravity: [0, 0, 0]\nbeams:\n  - {{name: rod, from: [0, 0, 0], to: [1, 0, 0], elements: {}, young: {}, "
        "density: "
        "1000, section: {{area: 1.0e-2, inertia_y: {:.17g}, inertia_z: {:.17g}, torsion: {:.17g}}}, fixed_ends: "
        "[from]}}\n"
        "loads: [{{name: P, body: rod_{}, force: [0, 0, {:.17g}]}}]\n",
        elements, young, inertia, inertia, inertia, elements, -P);
}

TEST(Equilibrium, ACantileverUnderAnEndLoadIsTheElastica) {
    // Mattiasson, Int. J. Numer. Meth. Engng 17, 1981: w/L and u/L for P L²/(E I).
    struct Case {
        double load, w, u, tolerance;
    };
    for (const auto& [load, w, u, tolerance] :
         {Case{1.0, 0.30172, 0.05643, 4e-5}, Case{10.0, 0.81061, 0.55500, 4e-4}}) {
        const Found found(cantilever(18, 2.0, 2.0 * load));
        const auto tip = found.body("rod_18");
        EXPECT_NEAR(-tip[2], w, tolerance);
        EXPECT_NEAR(1.0 - tip[0], u, tolerance);
        EXPECT_GT(found.equilibrium.smallest_eigenvalue, 0.0);
    }
}

TEST(Equilibrium, ACantileverInOneStepIsThatInMany) {
    const Found many(cantilever(6, 2.0, 20.0));
    const Found one("start: {equilibrium: {load_steps: 1}}\n" + cantilever(6, 2.0, 20.0));
    // Where a load step is too long for Newton's method, it is divided.
    EXPECT_GE(many.equilibrium.load_steps.size(), 10U);
    EXPECT_EQ(many.equilibrium.load_steps.back().load, 1.0);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(one.body("rod_6")[i], many.body("rod_6")[i], 1e-8);
}

TEST(Equilibrium, ABarStretchesUnderItsWeight) {
    // Nodes at the ends of elements carry half of each: node k stretches by ρ g (L x − x²/2)/E there.
    constexpr int n = 8;
    const double length = 2.0, young = 1e6, density = 1000.0;
    std::string yaml = "nodes:\n";
    for (int k = 0; k <= n; ++k)
        yaml += fmt::format("  - {{name: n{}, fixed: {}, position: [0, 0, {:.17g}]}}\n", k, k == 0, -length * k / n);
    yaml += "cables:\n";
    for (int k = 0; k < n; ++k)
        yaml +=
            fmt::format("  - {{name: c{}, nodes: [n{}, n{}], young: {}, area: 1.0e-3, density: {}, slack: false}}\n", k,
                        k, k + 1, young, density);
    const Found found(yaml);
    for (int k = 0; k <= n; ++k) {
        const double x = length * k / n;
        EXPECT_NEAR(found.node(k)[2], -x - density * g / young * (length * x - 0.5 * x * x), 1e-9) << k;
    }
    const Found block(
        "elastic_blocks:\n  - {name: bar, corner: [0, 0, -2], edges: [0.25, 0.25, 2], cells: [1, 1, 8], young: 1.0e+7, "
        "poisson: 0, density: 1000, fixed_faces: [z_max]}\n");
    double lowest = 0.0;
    for (int node = 0; node < 9; ++node) lowest += block.node(17 * node)[2] / 9.0;
    EXPECT_NEAR(-2.0 - lowest, 1000.0 * g * 4.0 / (2.0 * 1e7), 0.01 * 1000.0 * g * 4.0 / (2.0 * 1e7));
    EXPECT_GT(block.equilibrium.smallest_eigenvalue, 0.0);
}

TEST(Equilibrium, APendulumComesDownUnlessItStandsExactly) {
    const auto pendulum = [](double angle) {
        return fmt::format(
            "bodies: [{{name: rod, mass: 2, inertia: {{xx: 0.1, yy: 0.1, zz: 0.1}}, position: [{:.17g}, 0, "
            "{:.17g}]}}]\n"
            "joints: [{{name: pin, kind: revolute, second: rod, axis: [0, 1, 0]}}]\n",
            std::sin(angle), -std::cos(angle));
    };
    const double stiffness = 2.0 * g / (2.0 + 0.1);
    for (const double angle : {0.0, 0.5 * std::numbers::pi, 3.0}) {
        const Found down(pendulum(angle));
        EXPECT_NEAR(down.body("rod")[2], -1.0, 1e-12) << angle;
        EXPECT_NEAR(down.equilibrium.smallest_eigenvalue, stiffness, 1e-6);
        EXPECT_NEAR(std::abs(down.equilibrium.multipliers[2]), 2.0 * g, 1e-8) << "the pin carries the weight";
    }
    const Found upright(
        "bodies: [{name: rod, mass: 2, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, position: [0, 0, 1]}]\n"
        "joints: [{name: pin, kind: revolute, second: rod, axis: [0, 1, 0]}]\n");
    EXPECT_NEAR(upright.body("rod")[2], 1.0, 1e-12);
    EXPECT_NEAR(upright.equilibrium.smallest_eigenvalue, -stiffness, 1e-6);
}

TEST(Equilibrium, ARunThatBeginsThereStaysThere) {
    const std::string rod =
        "beams:\n  - {name: rod, from: [0, 0, 0], to: [1, 0, 0], elements: 6, young: 1.0e+7, density: 1000, "
        "section: {rectangle: [0.03, 0.03]}, fixed_ends: [from]}\n";
    for (const char* integrator : {"euler_implicit_linearized", "generalized_alpha"}) {
        Running run(parse_scene(
            fmt::format("step: 0.001\nend: 0.2\nstart: equilibrium\nintegrator: {}\n{}", integrator, rod), "s"));
        const auto before = run.pose("rod_6").position;
        EXPECT_LT(before[2], -0.1);
        run.finish();
        const auto after = run.pose("rod_6").position;
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(after[i], before[i], 1e-7) << integrator;
        EXPECT_LT(run.simulation.record().kinetic, 1e-12);
        EXPECT_NE(run.simulation.start().find("static equilibrium after 10 load steps"), std::string::npos);
    }
}

TEST(Equilibrium, WhatHasNoneIsRefusedInASentence) {
    const std::string body = "bodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}%}]\n";
    const auto with = [&](const std::string& more) {
        std::string text = body;
        return text.replace(text.find('%'), 1, more);
    };
    EXPECT_TRUE(has(refusal(with("")), "no equilibrium was found"));
    EXPECT_TRUE(has(refusal(with(", velocity: [1, 0, 0]")), "begins at rest"));
    EXPECT_TRUE(has(refusal(with("") + "joints: [{name: j, kind: revolute, second: b}]\n"
                                       "motors: [{name: m, joint: j, speed: true, motion: 1}]\n"),
                    "at t = 0"));
    EXPECT_TRUE(has(refusal(with("") + "joints: [{name: j, kind: revolute, second: b}]\n"
                                       "motors: [{name: m, joint: j, speed: true, motion: 0, force_limit: 1}]\n"),
                    "no motors and actuators with a limit"));
    EXPECT_TRUE(has(refusal("start: given\n" + with("")), "must be equilibrium"));
    EXPECT_TRUE(has(refusal("start: {equilibrium: {method: riks}}\n" + with("")), "load_steps or arc_length"));
    EXPECT_TRUE(has(refusal("start: {equilibrium: {load_steps: 0}}\n" + with("")), "from 1 to"));
#ifdef DELASSUS_HAS_FCL
    EXPECT_TRUE(has(refusal("bodies:\n  - {name: ground, fixed: true, shapes: [{plane: {}}]}\n"
                            "  - {name: b, mass: 1, position: [0, 0, 1], shapes: [{sphere: {radius: 0.5}}]}\n"
                            "springs: [{name: s, first_point: [0, 0, 2], second: b, stiffness: 5}]\n"),
                    "contact or a stop"));
#endif
}

}  // namespace
}  // namespace delassus::tests::equilibrium_test
