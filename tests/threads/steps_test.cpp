// SPDX-License-Identifier: BSD-3-Clause
// Steps of scenes by several threads: contacts, parts side by side, and one part by all threads.
#ifdef DELASSUS_HAS_FCL
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "delassus/error.hpp"
#include "delassus/scene.hpp"
#include "delassus/simulation.hpp"
#include "support/places.hpp"

namespace delassus::steps_in_threads_test {
namespace {

std::string head(const std::string& more) {
    return "step: 0.004\nend: 10\nsolver: {name: " + std::string(tests::places::plugins) +
           "/apgd.so, law: associated, tolerance: 1.0e-4}\nmaterials: {stone: {friction: 0.6}}\n" + more;
}

/// A block of balls that touch, a little out of line, and so one part of some 5000 rows.
std::string heap() {
    return head(R"(
bodies:
  - {name: ground, fixed: true, shapes: [{plane: {}, material: stone}]}
  - name: ball_{i}_{j}_{k}
    density: 1000
    position: [0, 0, 0.0499]
    velocity: [0.1, 0.05, -0.3]
    shapes: [{sphere: {radius: 0.05}, material: stone}]
    repeat: {count: [8, 8, 10], spacing: [0.0998, 0.0999, 0.0997]}
)");
}

/// Small heaps far apart on uneven ground, one of them with a pendulum in it, that may sleep.
std::string islands() {
    std::string text = head(R"(
sleeping: {speed: 0.5, time: 0.02}
bodies:
  - name: ground
    fixed: true
    shapes: [{height_field: {size: [100, 10], heights: [[0, 0.001, 0, 0.002], [0, 0, 0.001, 0]]}, material: stone}]
  - {name: hanger, mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, position: [20.5, 0, 0.5],
     shapes: [{box: {size: [0.3, 0.1, 0.1]}, material: stone}]}
)");
    for (int k = 0; k < 6; ++k)
        text += "  - name: heap_" + std::to_string(k) + "_{i}_{j}_{k}\n    density: 1000\n    position: [" +
                std::to_string(7 * k - 20) + R"(, 0, 0.06]
    shapes: [{box: {size: [0.1, 0.1, 0.1]}, material: stone}]
    repeat: {count: [2, 2, 4], spacing: [0.11, 0.0999, 0.1005]}
)";
    return text + "joints:\n  - {name: hinge, kind: revolute, second: hanger, point: [21, 0, 0.5], axis: [0, 1, 0]}\n";
}

struct Course {
    std::vector<double> values;  ///< q and v after every step
    std::int64_t solves = 0, resting = 0, most_contacts = 0;
};

Course run(const std::string& text, int threads, int steps) {
    static const Registry registry;
    Scene scene = parse_scene(text, "test");
    Simulation simulation(scene.systems.at(0), registry);
    simulation.solver().use(std::make_shared<ThreadTeam>(threads));
    Course result;
    for (int step = 0; step < steps; ++step) {
        simulation.step();
        const State& state = simulation.state();
        result.values.insert(result.values.end(), state.q.begin(), state.q.end());
        result.values.insert(result.values.end(), state.v.begin(), state.v.end());
    }
    const SimulationTotals& totals = simulation.totals();
    result.solves = totals.plugin_solves;
    result.resting = totals.resting_parts;
    result.most_contacts = totals.most_contacts;
    return result;
}

TEST(StepsInThreads, OfOneLargePartHaveTheSameBits) {
#if defined(__SANITIZE_THREAD__)
    constexpr int steps = 2;
#else
    constexpr int steps = 4;
#endif
    const Course one = run(heap(), 1, steps);
    EXPECT_GT(one.most_contacts, 1100);  // enough for collision and solver to share
    for (const int threads : {2, 3}) EXPECT_EQ(run(heap(), threads, steps).values, one.values) << threads << " threads";
}

TEST(StepsInThreads, OfManyPartsHaveTheSameBits) {
    const Course one = run(islands(), 1, 40);
    EXPECT_GT(one.solves, 40);
    EXPECT_GT(one.resting, 0);
    for (const int threads : {2, 3}) {
        const Course several = run(islands(), threads, 40);
        EXPECT_EQ(several.values, one.values) << threads << " threads";
        EXPECT_EQ(several.solves, one.solves);
        EXPECT_EQ(several.resting, one.resting);
    }
}

/// Each thread asks; the step is undone as a whole, and the next goes on.
TEST(StepsInThreads, AreInterruptedAndGoOn) {
    static const Registry registry;
    Scene scene = parse_scene(islands(), "test");
    Simulation simulation(scene.systems.at(0), registry);
    simulation.solver().use(std::make_shared<ThreadTeam>(3));
    for (int step = 0; step < 5; ++step) simulation.step();
    const std::vector<double> before = simulation.state().v;
    std::atomic<int> questions = 0;
    simulation.solver().interrupt_by([&] { return ++questions > 4; });
    EXPECT_THROW(simulation.step(), StepInterrupted);
    EXPECT_EQ(simulation.state().v, before);
    simulation.solver().interrupt_by({});
    for (int step = 5; step < 8; ++step) simulation.step();
    const State& state = simulation.state();
    const Course one = run(islands(), 1, 8);
    const std::vector<double> end(one.values.end() - static_cast<std::ptrdiff_t>(state.v.size()), one.values.end());
    EXPECT_EQ(state.v, end);
}

/// A part whose solver cannot take it fails the step with its sentence, whatever the others do.
TEST(StepsInThreads, FailWithTheSentenceOfTheFirstPartThatCannotBeSolved) {
    static const Registry registry;
    // Cholesky's factor holds no contact.
    std::string text = islands();
    const std::size_t solver = text.find("name: ");
    text.replace(solver, text.find(", law") - solver, "name: cholmod");
    std::string sentences[2];
    for (const int threads : {1, 3}) {
        Scene scene = parse_scene(text, "test");
        try {
            Simulation simulation(scene.systems.at(0), registry);
            simulation.solver().use(std::make_shared<ThreadTeam>(threads));
            for (int step = 0; step < 10; ++step) simulation.step();
        } catch (const Error& error) {
            sentences[threads == 1 ? 0 : 1] = error.what();
        }
    }
    EXPECT_NE(sentences[0].find("cholmod cannot"), std::string::npos) << sentences[0];
    EXPECT_EQ(sentences[1], sentences[0]);
}

}  // namespace
}  // namespace delassus::steps_in_threads_test
#endif
