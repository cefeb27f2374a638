// SPDX-License-Identifier: BSD-3-Clause
// Paths of equilibria past limit points, against closed forms and published values.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <vector>

#include "delassus/equilibrium.hpp"
#include "delassus/error.hpp"
#include "delassus/timestepper.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::equilibrium_path_test {
namespace {

const std::string head = "step: 0.001\nend: 0.1\ngravity: [0, 0, 0]\n";

/// The path of a scene's only system.
struct Followed {
    Scene scene;
    std::vector<State> states;
    EquilibriumPath path;

    explicit Followed(const std::string& yaml, const PathRule& rule = {})
        : scene(parse_scene(yaml, "s")), path(follow_equilibria(scene.systems.at(0), registry(), rule, keep())) {}
    PathHook keep() {
        return [this](const PathPoint&, const State& state) { states.push_back(state); };
    }
    [[nodiscard]] const MultibodySystem& system() const { return *scene.systems.at(0).system; }
    /// Displacement of a body along z at each point.
    [[nodiscard]] std::vector<double> sinking(const std::string& body) const {
        std::vector<double> result;
        const auto index = system().find_body(body);
        for (const State& state : states)
            result.push_back(system().pose(state, index).position[2] -
                             system().pose(system().initial_state(), index).position[2]);
        return result;
    }
    [[nodiscard]] std::vector<PathPoint> marked(PathMark mark) const {
        std::vector<PathPoint> result;
        for (const PathPoint& point : path.points)
            if (point.mark == mark) result.push_back(point);
        return result;
    }
};

// ---- Von Mises' truss ----

constexpr double rise = 0.25, stiffness = 1000.0;

/// The load on two springs from (±1, 0, 0) to the apex at the height z.
double truss_load(double z, double bars) {
    const double natural = std::hypot(1.0, rise), length = std::hypot(1.0, z);
    return bars * stiffness * (natural - length) * z / length;
}

/// Its extremum: dP/dz = 0 where ℓ³ = ℓ₀ for a half span of 1.
double truss_limit(double bars) {
    const double length = std::cbrt(std::hypot(1.0, rise));
    return truss_load(std::sqrt(length * length - 1.0), bars);
}

std::string truss(double load) {
    return head + fmt::format(
                      "bodies: [{{name: apex, mass: 1, inertia: {{xx: 1, yy: 1, zz: 1}}, position: [0, 0, 0.25]}}]\n"
                      "joints: [{{name: guide, kind: prismatic, second: apex, point: [0, 0, 0.25]}}]\n"
                      "springs:\n"
                      "  - {{name: left, second: apex, first_point: [-1, 0, 0], stiffness: 1000}}\n"
                      "  - {{name: right, second: apex, first_point: [1, 0, 0], stiffness: 1000}}\n"
                      "loads: [{{name: P, body: apex, force: [0, 0, {}]}}]\n",
                      -load);
}

TEST(EquilibriumPath, VonMisesTrussSnapsThrough) {
    const double load = 30.0;
    const Followed found(truss(load));
    ASSERT_TRUE(found.path.complete) << found.path.ending;
    const auto sinking = found.sinking("apex");
    ASSERT_EQ(sinking.size(), found.path.points.size());
    for (std::size_t i = 0; i < sinking.size(); ++i)
        EXPECT_NEAR(load * found.path.points[i].load, truss_load(rise + sinking[i], 2.0), 1e-9) << i;
    const auto limits = found.marked(PathMark::Limit);
    ASSERT_EQ(limits.size(), 2U);
    EXPECT_NEAR(load * limits[0].load, truss_limit(2.0), 1e-9);
    EXPECT_NEAR(load * limits[1].load, -truss_limit(2.0), 1e-9);
    EXPECT_TRUE(found.marked(PathMark::Bifurcation).empty());
    EXPECT_NEAR(found.path.points.back().load, 1.0, 1e-12);
    EXPECT_LT(sinking.back(), -2.0 * rise);
    // Stable up to the first limit point and from the second on.
    for (const PathPoint& point : found.path.points) {
        if (point.mark == PathMark::Limit) continue;
        const bool between = point.arc > limits[0].arc && point.arc < limits[1].arc;
        EXPECT_EQ(point.negative_eigenvalues, between ? 1 : 0) << point.arc;
    }
    EXPECT_GT(found.path.end.smallest_eigenvalue, 0.0);
    EXPECT_LE(found.path.points.size(), 40U);
}

TEST(EquilibriumPath, TheLimitLoadIsFoundWhateverTheFirstStepAndTheUnits) {
    for (const char* rule : {"1", "3", "37"})
        for (const double load : {11.0, 700.0}) {
            const Followed found(fmt::format("start: {{equilibrium: {{load_steps: {}}}}}\n{}", rule, truss(load)));
            const auto limits = found.marked(PathMark::Limit);
            ASSERT_EQ(limits.size(), 2U) << rule << ' ' << load;
            EXPECT_NEAR(load * limits[0].load, truss_limit(2.0), 1e-8) << rule << ' ' << load;
        }
}

TEST(EquilibriumPath, EndsAtADisplacement) {
    Followed whole(truss(30.0));
    PathRule rule;
    rule.displacement = PathDisplacement{whole.system().find_body("apex"), -1, 2, -0.3};
    const Followed found(truss(30.0), rule);
    ASSERT_TRUE(found.path.complete);
    EXPECT_NEAR(found.sinking("apex").back(), -0.3, 1e-12);
    EXPECT_NEAR(30.0 * found.path.points.back().load, truss_load(rise - 0.3, 2.0), 1e-9);
    EXPECT_EQ(found.marked(PathMark::Limit).size(), 1U);
    EXPECT_LT(found.path.end.smallest_eigenvalue, 0.0);
}

TEST(EquilibriumPath, ARunBeginsBehindTheLimitPoint) {
    Running run(
        parse_scene("integrator: generalized_alpha\nstart: {equilibrium: {method: arc_length}}\n" + truss(30.0), "s"));
    const auto before = run.pose("apex").position[2];
    EXPECT_LT(before, -rise);
    run.finish();
    EXPECT_NEAR(run.pose("apex").position[2], before, 1e-9);
}

TEST(EquilibriumPath, EndsWithASentenceWhereItHasTooFewPoints) {
    PathRule rule;
    rule.most_points = 5;
    const Followed found(truss(30.0), rule);
    EXPECT_FALSE(found.path.complete);
    EXPECT_NE(found.path.ending.find("the path has 5 points"), std::string::npos) << found.path.ending;
    EXPECT_THROW((void)Followed(truss(30.0), PathRule{.load = -1.0, .displacement = {}}), InputError);
    EXPECT_THROW((void)Followed(truss(30.0), PathRule{.displacement = {}, .most_points = 0}), InputError);
    EXPECT_THROW((void)Followed(head + "bodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]\n"
                                       "loads: [{name: P, body: b, force: [0, 0, 1]}]\n"),
                 StepFailure);
}

// ---- Frames and arches of beams ----

/// PL²/(EI) of Lee's frame with so many elements in each beam, at its marked points.
std::vector<double> lees_loads(int elements, double* snap_back = nullptr) {
    SceneOverrides overrides;
    for (const char* beam : {"column", "girder"})
        overrides.values.emplace_back(fmt::format("beams.{}.elements", beam), std::to_string(elements));
    overrides.values.emplace_back("joints.corner.first", fmt::format("column_{}", elements));
    overrides.values.emplace_back("joints.end.second", fmt::format("girder_{}", elements));
    overrides.values.emplace_back("loads.P.body", fmt::format("girder_{}", elements / 5));
    Scene scene = read_scene(example_scene("lees_frame"), overrides);
    SceneSystem& system = scene.systems.at(0);
    const auto loaded = system.system->find_body(fmt::format("girder_{}", elements / 5));
    double deepest = 0.0, back = 0.0;
    const auto path = follow_equilibria(system, registry(), {}, [&](const PathPoint& point, const State& state) {
        const double down = 1.2 - system.system->pose(state, loaded).position[2];
        if (point.load < 0.0) return;
        deepest = std::max(deepest, down);
        back = std::max(back, deepest - down);
    });
    EXPECT_TRUE(path.complete) << path.ending;
    if (snap_back) *snap_back = back;
    std::vector<double> loads;
    for (const PathPoint& point : path.points)
        if (point.mark != PathMark::None) {
            EXPECT_EQ(point.mark, PathMark::Limit);
            loads.push_back(30000.0 * point.load * 1.44 / (7.2e10 * 2e-8));
        }
    return loads;
}

TEST(EquilibriumPath, LeesFrameSnapsBack) {
    // Schweizerhof and Wriggers, Comput. Methods Appl. Mech. Engrg. 59, 1986: 18.532. Corotational beams converge with
    // the square of their size.
    double snap_back = 0.0;
    const auto coarse = lees_loads(10), fine = lees_loads(20, &snap_back);
    ASSERT_EQ(coarse.size(), 2U);
    ASSERT_EQ(fine.size(), 2U);
    EXPECT_NEAR(fine[0], 18.532, 0.01 * 18.532);
    const double extrapolated = fine[0] + (fine[0] - coarse[0]) / 3.0;
    RecordProperty("extrapolated", std::to_string(extrapolated));
    EXPECT_NEAR(extrapolated, 18.532, 0.003 * 18.532);
    EXPECT_NEAR(fine[1] + (fine[1] - coarse[1]) / 3.0, -9.4, 0.05);
    EXPECT_GT(snap_back, 0.05) << "the loaded point comes back while the load falls";
}

/// A circular arch of so many beams over an angle, R = 100, E I = 10⁶, hinged at its first end and clamped or hinged at
/// the other, with a load at its crown.
std::string circular_arch(int elements, double degrees, bool clamped, double load, double area) {
    std::string bodies = "bodies:\n", names;
    const double angle = degrees * std::numbers::pi / 180.0, radius = 100.0;
    const auto place = [&](int k) {
        const double t = angle * (static_cast<double>(k) / elements - 0.5);
        return fmt::format("[{:.17g}, 0, {:.17g}]", radius * std::sin(t), radius * std::cos(t));
    };
    for (int k = 0; k <= elements; ++k) {
        bodies +=
            fmt::format("  - {{name: n{}, mass: 1, inertia: {{xx: 1, yy: 1, zz: 1}}, position: {}}}\n", k, place(k));
        names += fmt::format("{}n{}", k == 0 ? "" : ", ", k);
    }
    return head + bodies +
           fmt::format(
               "beams:\n  - {{name: arch, bodies: [{}], section_y: [0, 1, 0], young: 1.0e+6, section: {{area: {}, "
               "inertia_y: 1, inertia_z: 1000, torsion: 1000}}}}\n"
               "joints:\n  - {{name: left, kind: revolute, second: n0, point: {}, axis: [0, 1, 0]}}\n"
               "  - {{name: right, kind: {}, second: n{}, point: {}, axis: [0, 1, 0]}}\n"
               "loads:\n  - {{name: P, body: n{}, force: [0, 0, {}]}}\n",
               names, area, place(0), clamped ? "fixed" : "revolute", elements, place(elements), elements / 2, -load);
}

TEST(EquilibriumPath, ADeepClampedHingedArchBuckles) {
    // DaDeppo and Schmidt, J. Appl. Mech. 42, 1975: P R²/(E I) = 8.97 for 215° and an axis that does not stretch.
    const auto critical = [](int elements) {
        const Followed found(circular_arch(elements, 215.0, true, 1200.0, 100.0));
        const auto limits = found.marked(PathMark::Limit);
        return limits.empty() ? 0.0 : limits[0].load * 1200.0 * 1e4 / 1e6;
    };
    const double coarse = critical(20), fine = critical(40);
    EXPECT_NEAR(fine, 8.97, 0.01 * 8.97);
    RecordProperty("extrapolated", std::to_string(fine + (fine - coarse) / 3.0));
    EXPECT_NEAR(fine + (fine - coarse) / 3.0, 8.97, 0.002 * 8.97);
}

TEST(EquilibriumPath, AShallowArchHasABifurcationBeforeItsLimitPoint) {
    // As in Fung and Kaplan, NACA TN 2840, 1952: a high arch leaves the symmetric path before its limit point. That
    // path is followed past both; with a hundredth of the load off the crown there is no bifurcation, but a limit point
    // below.
    const std::string arch = circular_arch(16, 40.0, false, 12000.0, 10.0);
    const Followed perfect(arch);
    const auto bifurcations = perfect.marked(PathMark::Bifurcation), limits = perfect.marked(PathMark::Limit);
    ASSERT_GE(bifurcations.size(), 1U);
    ASSERT_GE(limits.size(), 2U);
    EXPECT_LT(bifurcations[0].load, limits[0].load);
    EXPECT_LT(bifurcations[0].arc, limits[0].arc);
    const Followed off(arch + "  - {name: Q, body: n7, force: [0, 0, -120]}\n");
    ASSERT_GE(off.marked(PathMark::Limit).size(), 1U);
    const double limit = off.marked(PathMark::Limit)[0].load;
    EXPECT_LT(limit, bifurcations[0].load);
    EXPECT_GT(limit, 0.8 * bifurcations[0].load);
}

// ---- Columns ----

/// A column of height 1, clamped at its foot, with a push of `share` of Euler's load and one across it at the head.
std::string column(int elements, double share, double across) {
    const double euler = 0.25 * std::numbers::pi * std::numbers::pi * 2.0;
    return head + fmt::format(
                      "beams:\n  - {{name: rod, from: [0, 0, 0], to: [0, 0, 1], elements: {}, young: 1.0e+9, density: "
                      "1000, section_y: [0, 1, 0], section: {{area: 1.0e-2, inertia_y: 2.0e-9, inertia_z: 1.0e-7, "
                      "torsion: 1.0e-7}}, fixed_ends: [from]}}\n"
                      "loads: [{{name: P, body: rod_{}, force: [{}, 0, {:.17g}]}}]\n",
                      elements, elements, across, -share * euler);
}

TEST(EquilibriumPath, EulersLoadIsABifurcation) {
    const auto critical = [](int elements) {
        const Followed found(column(elements, 1.5, 0.0));
        const auto bifurcations = found.marked(PathMark::Bifurcation);
        EXPECT_EQ(bifurcations.size(), 1U);
        EXPECT_TRUE(found.marked(PathMark::Limit).empty());
        EXPECT_EQ(found.path.points.back().negative_eigenvalues, 1);
        return bifurcations.empty() ? 0.0 : 1.5 * bifurcations[0].load;
    };
    const double coarse = critical(8), fine = critical(16);
    RecordProperty("coarse", std::to_string(coarse));
    RecordProperty("fine", std::to_string(fine));
    EXPECT_NEAR(fine, 1.0, 5e-3);
    EXPECT_NEAR(fine + (fine - coarse) / 3.0, 1.0, 1e-4);
}

TEST(EquilibriumPath, AnImperfectColumnBendsAtEulersLoad) {
    // Small deflections at P = β P_E under a force F across the head: w = F L³/(E I) (tan u − u)/u³, u = π √β/2. Far
    // beyond Euler's load it is the elastica with the end angle α, K(sin α/2) = u: 1.5 P_E gives α = 92.0°.
    const double across = 0.001;
    const Followed found(column(20, 1.5, across));
    ASSERT_TRUE(found.path.complete);
    EXPECT_TRUE(found.marked(PathMark::Bifurcation).empty());
    const auto head_body = found.system().find_body("rod_20");
    int compared = 0;
    for (std::size_t i = 1; i < found.states.size(); ++i) {
        const double beta = 1.5 * found.path.points[i].load;
        if (beta > 0.8) break;
        const double u = 0.5 * std::numbers::pi * std::sqrt(beta), force = across * found.path.points[i].load;
        const double w = force / 2.0 * (std::tan(u) - u) / (u * u * u);
        EXPECT_NEAR(found.system().pose(found.states[i], head_body).position[0], w, 0.01 * w) << beta;
        ++compared;
    }
    EXPECT_GE(compared, 3);
    // The elastica by bisection; K by the arithmetic-geometric mean.
    const auto K = [](double k) {
        double a = 1.0, b = std::sqrt(1.0 - k * k);
        for (int i = 0; i < 40; ++i) {
            const double mean = 0.5 * (a + b);
            b = std::sqrt(a * b);
            a = mean;
        }
        return 0.5 * std::numbers::pi / a;
    };
    double low = 1e-6, high = 0.999999;
    for (int i = 0; i < 100; ++i)
        (K(0.5 * (low + high)) < 0.5 * std::numbers::pi * std::sqrt(1.5) ? low : high) = 0.5 * (low + high);
    // x of the head: 2 k/(√(P/EI) L).
    const double w = 2.0 * low / (0.5 * std::numbers::pi * std::sqrt(1.5));
    EXPECT_NEAR(found.system().pose(found.states.back(), head_body).position[0], w, 0.005);
    EXPECT_GT(found.path.end.smallest_eigenvalue, 0.0);
}

// ---- Where load stepping goes as well ----

TEST(EquilibriumPath, AgreesWithLoadSteppingWhereThereIsNoLimitPoint) {
    std::string cable = "step: 0.001\nend: 0.1\nnodes:\n";
    for (int k = 0; k <= 12; ++k)
        cable +=
            fmt::format("  - {{name: n{}, fixed: {}, position: [{:.17g}, 0, 0]}}\n", k, k == 0 || k == 12, 0.25 * k);
    cable += "cables:\n";
    for (int k = 0; k < 12; ++k)
        cable += fmt::format("  - {{name: c{}, nodes: [n{}, n{}], young: 1.0e+8, area: 1.0e-5, density: 4000}}\n", k, k,
                             k + 1);
    const std::string chain =
        "step: 0.001\nend: 0.1\nbodies:\n"
        "  - {name: a, mass: 1, inertia: {xx: 1.0e-3, yy: 1.0e-3, zz: 1.0e-3}, position: [0.5, 0, 0]}\n"
        "  - {name: b, mass: 2, inertia: {xx: 1.0e-3, yy: 1.0e-3, zz: 1.0e-3}, position: [1.5, 0, 0]}\n"
        "joints:\n  - {name: j0, kind: spherical, second: a}\n"
        "  - {name: j1, kind: spherical, first: a, second: b, point: [1, 0, 0]}\n";
    // From where the loads move it freely: the first load step is divided until there is an equilibrium.
    const std::string hinged =
        "step: 0.001\nend: 0.1\nbeams:\n  - {name: rod, from: [0, 0, 0], to: [1, 0, 0], elements: 4, young: 2.0e+8, "
        "density: 1000, section: {rectangle: [0.03, 0.02]}, mass: consistent}\n"
        "joints: [{name: h, kind: revolute, second: rod_0, axis: [0, 1, 0]}]\n";
    for (const std::string& yaml : {cable, chain, hinged, column(8, 0.5, 0.3)}) {
        Scene scene = parse_scene(yaml, "s");
        const Equilibrium stepped = find_equilibrium(scene.systems.at(0), registry());
        const Followed found(yaml);
        ASSERT_TRUE(found.path.complete) << found.path.ending;
        EXPECT_TRUE(found.marked(PathMark::Limit).empty());
        const MultibodySystem& system = found.system();
        for (BodyIndex i = 0; i < system.body_count(); ++i)
            for (std::size_t k = 0; k < 3; ++k)
                EXPECT_NEAR(system.pose(found.path.end.state, i).position[k], system.pose(stepped.state, i).position[k],
                            1e-8);
        for (std::int32_t i = 0; i < system.node_count(); ++i)
            for (std::size_t k = 0; k < 3; ++k)
                EXPECT_NEAR(system.node_position(found.path.end.state, i)[k], system.node_position(stepped.state, i)[k],
                            1e-8);
    }
}

TEST(EquilibriumPath, ATripodOfCablesSnapsThrough) {
    const double load = 9000.0;
    std::string yaml = head + "nodes:\n  - {name: apex, mass: 1, position: [0, 0, 0.25]}\n";
    for (int k = 0; k < 3; ++k)
        yaml += fmt::format("  - {{name: f{}, fixed: true, position: [{:.17g}, {:.17g}, 0]}}\n", k,
                            std::cos(2.0 * std::numbers::pi * k / 3.0), std::sin(2.0 * std::numbers::pi * k / 3.0));
    yaml += "cables:\n";
    for (int k = 0; k < 3; ++k)
        yaml += fmt::format(
            "  - {{name: c{}, nodes: [apex, f{}], young: {:.17g}, area: 1.0e-3, density: 1, slack: false}}\n", k, k,
            300.0 * stiffness * 1e3 * std::hypot(1.0, rise));
    yaml += fmt::format("loads: [{{name: P, node: apex, force: [0, 0, {}]}}]\n", -load);
    const Followed found(yaml);
    ASSERT_TRUE(found.path.complete);
    const auto limits = found.marked(PathMark::Limit);
    ASSERT_EQ(limits.size(), 2U);
    EXPECT_NEAR(load * limits[0].load, 300.0 * truss_limit(3.0), 1e-6);
    EXPECT_TRUE(found.marked(PathMark::Bifurcation).empty()) << "three bars hold the apex sideways";
}

// ---- The command ----

TEST(EquilibriumPath, TheCommandWritesTheTable) {
    const ScratchFolder scratch;
    const std::string scene = (scratch / "truss.yaml").string(), out = (scratch / "out").string();
    std::ofstream(scene) << truss(30.0);
    const auto result = run_command("equilibrium " + scene + " --path --watch apex -o " + out);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("limit point at the load factor 0.19444364"), std::string::npos) << result.out;
    std::ifstream table(scratch / "out" / "main.path.csv");
    std::string line;
    std::getline(table, line);
    EXPECT_EQ(line,
              "load,arc_length,largest_displacement,energy,negative_eigenvalues,newton_iterations,residual,mark,apex.x,"
              "apex.y,apex.z");
    int rows = 0, limits = 0;
    while (std::getline(table, line)) {
        ++rows;
        if (line.find("limit point") != std::string::npos) ++limits;
    }
    EXPECT_GT(rows, 10);
    EXPECT_EQ(limits, 2);
    EXPECT_EQ(run_command("equilibrium " + scene + " --until 0.5").exit_code, 2);
    EXPECT_EQ(run_command("equilibrium " + scene + " --path --until apex.w=1").exit_code, 2);
    EXPECT_EQ(run_command("equilibrium " + scene + " --path --until none.z=1").exit_code, 2);
    // What fails leaves nothing.
    const auto nothing = (scratch / "nothing").string();
    EXPECT_EQ(run_command("equilibrium " + scene + " --path --watch none -o " + nothing).exit_code, 2);
    EXPECT_FALSE(std::filesystem::exists(nothing));
    const auto falls = (scratch / "falls.yaml").string();
    std::ofstream(falls) << "step: 0.01\nend: 1\nbodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]\n";
    EXPECT_EQ(run_command("equilibrium " + falls + " -o " + nothing).exit_code, 3);
    EXPECT_FALSE(std::filesystem::exists(nothing));
    EXPECT_EQ(run_command("equilibrium " + scene + " --path --until 1e").exit_code, 2);
    EXPECT_EQ(run_command("equilibrium " + scene + " --path --points 3").exit_code, 0);
}

}  // namespace
}  // namespace delassus::tests::equilibrium_path_test
