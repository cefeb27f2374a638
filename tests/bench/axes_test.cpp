// SPDX-License-Identifier: BSD-3-Clause
// Axes of a suite: what is read, how a run is judged, where a method breaks, and a small suite from end to end.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "bench/bench_writers.hpp"
#include "bench/formula.hpp"
#include "bench/outcome.hpp"
#include "bench/results_file.hpp"
#include "bench/suite.hpp"
#include "bench_fixture.hpp"
#include "delassus/error.hpp"
#include "support/places.hpp"

namespace delassus::bench_test::axes_test {
namespace {

using bench::Json;

class Axes : public BenchTest {
protected:
    [[nodiscard]] bench::Suite read(const std::string& text) const {
        return bench::read_suite(suite(text), Registry({fs::path(tests::places::plugins)}));
    }
    void write_falling_body() const {
        std::ofstream(folder / "fall.yaml") << "step: 0.01\nend: 0.1\n"
                                               "bodies: [{name: stone, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]\n";
    }
};

TEST(Formula, IsFilledIn) {
    EXPECT_EQ(bench::fill_in("[0, 0, $(0.5 * value)]", 3.0), "[0, 0, 1.5]");
    EXPECT_EQ(bench::fill_in("$((value / 0.5) ^ 2 - 1) m", 2.0), "15 m");
    EXPECT_EQ(bench::fill_in("$(-value ^ 2)$(2 ^ -1)", 3.0), "-90.5");
    EXPECT_EQ(bench::fill_in("value", 3.0), "value");
    EXPECT_EQ(bench::fill_in("$(sqrt(2 * (value + 5))) $(2 ^ 3 ^ 2)", 3.0), "4 512");
    for (const char* wrong : {"$(", "$(2", "$(2 3)", "$(x)", "$(1 / 0)", "$()", "$(sqrt(-1))", "$(1, 2)",
                              "$(value = 2)", "$(nan)", "$(\"a\")", "$(1e999)"})
        EXPECT_THROW(static_cast<void>(bench::fill_in(wrong, 1.0)), InputError) << wrong;
    try {
        static_cast<void>(bench::fill_in("[$(2 * vale)]", 1.0));
        FAIL() << "an unknown name";
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(),
                     "the formula in \"[$(2 * vale)]\" cannot be read: Unexpected token \"vale\" found at position 4; "
                     "a formula has numbers, \"value\", + - * / ^, parentheses and functions such as sqrt and exp");
    }
}

TEST_F(Axes, ValuesAndBoundsExpand) {
    write_falling_body();
    const auto suite = read(
        "time_limit: 3\n"
        "solvers: [pgs]\n"
        "axes:\n"
        "  - {name: boxes, generate: box_stack, set: {boxes: $(value), mass: 2}, values: [1, 4], bounds: {speed: "
        "$(1e-7 * value)}}\n"
        "  - name: fall\n"
        "    scene: fall.yaml\n"
        "    set: {bodies.stone.mass: $(value ^ 2), gravity: '[0, 0, $(-value)]'}\n"
        "    values: [1, 3]\n"
        "    bounds: {drift: [1, 2], position: {body: stone, at: [[0, 0, 0], [0, 0, $(-value)]], within: 0.1}}\n"
        "    timesteppers: [rk4, hht]\n");
    ASSERT_EQ(suite.axes.size(), 2U);
    const auto& boxes = suite.axes[0];
    EXPECT_EQ(boxes.problems[1].parameters, (std::map<std::string, double>{{"boxes", 4.0}, {"mass", 2.0}}));
    EXPECT_DOUBLE_EQ(boxes.bounds[1].at(0).limit, 4e-7);
    EXPECT_EQ(boxes.solvers.at(0).name, "pgs");
    EXPECT_EQ(boxes.time_limit, 3.0);
    const auto& fall = suite.axes[1];
    EXPECT_EQ(fall.scenes[1].settings.at("bodies.stone.mass"), "9");
    EXPECT_EQ(fall.scenes[1].settings.at("gravity"), "[0, 0, -3]");
    EXPECT_EQ(fall.bounds[1].at(0).limit, 2.0);
    EXPECT_EQ(fall.positions[1], (std::array<double, 3>{0.0, 0.0, -3.0}));
    EXPECT_EQ(fall.timesteppers.size(), 2U);
}

TEST_F(Axes, MistakesAreNamedWithTheirPlace) {
    write_falling_body();
    const std::string head = "axes:\n  - {name: a, generate: box_stack, set: {boxes: $(value)}, ";
    const std::string scene = "axes:\n  - {name: a, scene: fall.yaml, set: {step: $(value)}, values: [1, 2], ";
    const std::map<std::string, std::string> cases = {
        {head + "values: [1]}\n", "line 2: an axis needs \"bounds\""},
        {head + "bounds: {speed: 1}}\n", "line 2: an axis needs its \"values\""},
        {head + "values: [1, x], bounds: {speed: 1}}\n", "line 2: \"values\" is \"x\"; it must be a finite number"},
        {head + "values: [1, 2], bounds: {sped: 1}}\n",
         "line 2: problems have no measure \"sped\"; did you mean \"speed\"?"},
        {head + "values: [1, 2], bounds: {drift: 1}}\n", "line 2: problems have no measure \"drift\""},
        {head + "values: [1, 2], bounds: {speed: -1}}\n", "line 2: the bound of \"speed\" is negative"},
        {head + "values: [1, 2], bounds: {speed: [1]}}\n", "line 2: \"speed\" has 1 bounds for 2 values"},
        {head + "values: [1, 2], bounds: {speed: $(1 +)}}\n", "line 2: the formula in \"$(1 +)\" cannot be read"},
        {head + "values: [0.5], bounds: {speed: 1}}\n", "line 2: box_stack: boxes = 0.5 lies outside its range"},
        {head + "value: [1], bounds: {speed: 1}}\n",
         "line 2: an axis of the suite has no key \"value\"; did you mean \"values\"?"},
        {head + "values: [1], bounds: {speed: 1}, timesteppers: [hht]}\n",
         "line 2: \"timesteppers\" and \"step_solvers\" are keys of scenes"},
        {"axes:\n  - {name: a, generate: box_stack, values: [1, 2], bounds: {speed: 1}}\n",
         "line 2: nothing in \"set\" depends on the value"},
        {scene + "bounds: {velocity: 1}}\n", "line 2: scenes have no measure \"velocity\""},
        {scene + "bounds: {position: {body: stone, within: 1}}}\n",
         "line 2: \"position\" needs \"body\", \"at\" and \"within\""},
        {scene + "bounds: {position: {body: stone, at: [0, 0], within: 1}}}\n", "line 2: \"at\" must be [x, y, z]"},
        {scene + "bounds: {drift: 1}, timesteppers: [hhtt]}\n",
         "line 2: there is no timestepper \"hhtt\"; did you mean \"hht\"?"},
        {scene + "bounds: {drift: 1}, tolerance: 1}\n",
         "line 2: \"solvers\", \"law\" and \"tolerance\" are keys of problems"},
        {head + "values: [1], bounds: {speed: 1}}\n  - {name: a, scene: fall.yaml, values: [0], bounds: {drift: 1}}\n",
         "line 3: the axis \"a\" is listed twice"}};
    for (const auto& [text, sentence] : cases) {
        try {
            static_cast<void>(read(text));
            ADD_FAILURE() << text;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(sentence), std::string::npos) << text << error.what();
        }
    }
}

// What a plugin does becomes the outcome; the stops' answer is λ = (1, 0, 3), and as a reduced problem it has no x.
TEST_F(Axes, AMisbehavingPluginIsSeenThrough) {
    const std::vector<bench::Bound> bounds = {{"natural", 1e-3}};
    const auto outcome = [&](const std::string& behaviour, const std::vector<bench::Bound>& limits) {
        return bench::judge(measure(behaviour, 0.3), limits).outcome;
    };
    EXPECT_EQ(outcome("solve", bounds), "correct");
    EXPECT_EQ(outcome("lie", bounds), "wrong");
    EXPECT_EQ(outcome("nan", bounds), "failed");
    EXPECT_EQ(outcome("crash", bounds), "crashed");
    EXPECT_EQ(outcome("exit", bounds), "crashed");
    EXPECT_EQ(outcome("hang", bounds), "hung");
    EXPECT_EQ(outcome("slow", bounds), "failed");
    const auto thrown = bench::judge(measure("throw", 0.3), bounds);
    EXPECT_EQ(thrown.outcome, "failed");
    EXPECT_NE(thrown.sentence.find("the matrix is on fire"), std::string::npos) << thrown.sentence;
    const auto refused = bench::judge(measure("solve", 0.3, "friction"), bounds);
    EXPECT_EQ(refused.outcome, "refused");
    EXPECT_FALSE(refused.sentence.empty());
}

TEST(Judgement, OfScenes) {
    bench::SimulationMeasurement run;
    run.status = "finished";
    run.watched = {{"drift", 2e-3}, {"energy_growth", 0.5}, {"place", {1.0, 0.0, 3e-3}}};
    const std::array<double, 3> place = {1.0, 4e-3, 0.0};
    auto judged = bench::judge(run, {{"drift", 1e-2}, {"position", 1e-2}}, place);
    EXPECT_EQ(judged.outcome, "correct");
    EXPECT_EQ(judged.measure, "position");  // 5e-3 of 1e-2 is nearer to its bound than 2e-3
    EXPECT_NEAR(judged.figure, 5e-3, 1e-15);
    judged = bench::judge(run, {{"drift", 1e-3}, {"energy_growth", 1.0}}, {});
    EXPECT_EQ(judged.outcome, "inaccurate");
    EXPECT_EQ(judged.measure, "drift");
    EXPECT_NE(judged.sentence.find("drift 2.00e-03 m, rad, bound 1.00e-03"), std::string::npos) << judged.sentence;
    run.watched["drift"] = nullptr;  // not finite
    EXPECT_EQ(bench::judge(run, {{"drift", 1.0}}, {}).outcome, "wrong");
    const std::map<std::string, std::string> outcomes = {
        {"diverged", "wrong"},  {"unsolved", "failed"}, {"failed", "failed"}, {"time_limit", "failed"},
        {"memory", "failed"},   {"error", "failed"},    {"input", "refused"}, {"unsupported", "refused"},
        {"crashed", "crashed"}, {"hung", "hung"}};
    for (const auto& [status, outcome] : outcomes) {
        run.status = status;
        EXPECT_EQ(bench::judge(run, {}, {}).outcome, outcome) << status;
    }
}

TEST(Judgement, AVelocityWithoutReferenceIsSaid) {
    bench::Measurement run;
    run.status = "solved";
    run.error = Errors{};
    run.speed = 1.0;
    const auto judged = bench::judge(run, {{"velocity", 1e-5}, {"speed", 2.0}});
    EXPECT_EQ(judged.outcome, "correct");
    EXPECT_NE(judged.sentence.find("the velocity was not judged"), std::string::npos);
    const auto beyond = bench::judge(run, {{"speed", 0.5}});
    EXPECT_EQ(beyond.outcome, "inaccurate");
    EXPECT_EQ(beyond.sentence, "speed 1.00e+00 m/s, rad/s, bound 5.00e-01");
    run.speed = NAN;
    EXPECT_EQ(bench::judge(run, {{"natural", 1.0}}).outcome, "wrong");
}

Json cell(const std::string& method, double value, const std::string& outcome) {
    return {{"axis", "ratio"},
            {"method", method},
            {"value", value},
            {"outcome", outcome},
            {"sentence", outcome == "correct" ? "" : "it | says"}};
}

bench::ResultSet hand_made() {
    bench::ResultSet set;
    set.axes = {{{"axis", "ratio"}, {"title", "Ratio of masses"}, {"unit", "kg"}}};
    for (const auto& [method, outcomes] :
         std::vector<std::pair<std::string, std::vector<std::string>>>{{"good", {"correct", "correct", "correct"}},
                                                                       {"late", {"correct", "failed", "correct"}},
                                                                       {"never", {"wrong", "crashed", "correct"}},
                                                                       {"other", {"refused", "refused", "refused"}}})
        for (std::size_t k = 0; k < 3; ++k) set.cells.push_back(cell(method, std::pow(10.0, k), outcomes[k]));
    return set;
}

TEST(Breakdowns, AreFoundInTheAxisOrder) {
    const auto all = bench::breakdowns(hand_made().cells);
    ASSERT_EQ(all.size(), 4U);
    EXPECT_EQ(all[0].last_correct, 100.0);
    EXPECT_FALSE(all[0].first_not);
    EXPECT_EQ(all[1].last_correct, 1.0);
    EXPECT_EQ(all[1].first_not, 10.0);
    EXPECT_EQ(all[1].outcome, "failed");
    EXPECT_EQ(all[1].correct_again, std::vector<double>{100.0});
    EXPECT_FALSE(all[2].last_correct);
    EXPECT_EQ(all[2].outcome, "wrong");
    EXPECT_EQ(all[3].outcome, "refused");
}

TEST(Breakdowns, StandInTheSummary) {
    const std::string text = bench::axes_markdown(hand_made());
    EXPECT_NE(text.find("6 correct, 0 inaccurate, 3 refused, 1 failed, 1 wrong, 1 crashed, 0 hung, of 12 runs."),
              std::string::npos)
        << text;
    EXPECT_NE(text.find("#### Ratio of masses (ratio, kg)"), std::string::npos) << text;
    EXPECT_NE(text.find("| late   |             1 |        10 | failed | it / says (correct again at 100) |"),
              std::string::npos)
        << text;
    EXPECT_NE(text.find("does not"), std::string::npos);
    EXPECT_NE(text.find("Refused from the start by: other."), std::string::npos) << text;
    EXPECT_TRUE(bench::axes_markdown({}).empty());
}

// Free fall by implicit Euler ends at −½ g t (t + h): within a bound of g t h of −½ g t² at any step, not within a
// hundredth of that.
TEST_F(Axes, ASmallSuiteRunsFromEndToEnd) {
    write_falling_body();
    std::ofstream(folder / "empty.yaml") << "step: 0.01\nend: 0.1\nbodies: []\n";
    const auto file = suite(
        "solvers: [pgs, apgd]\n"
        "axes:\n"
        "  - {name: boxes, generate: box_stack, set: {boxes: $(value)}, values: [1, 3], bounds: {speed: 1e-6}}\n"
        "  - name: fall\n"
        "    scene: fall.yaml\n"
        "    set: {step: $(value)}\n"
        "    values: [0.001, 0.01]\n"
        "    bounds: {position: {body: stone, at: [0, 0, -0.04905], within: 5e-4}}\n"
        "    timesteppers: [euler_implicit, hht]\n"
        "  - {name: nothing, scene: empty.yaml, values: [0], bounds: {speed: 0}}\n"
        "  - {name: impossible, scene: fall.yaml, set: {step: $(value)}, values: [-1], bounds: {speed: 0}}\n");
    ASSERT_EQ(run_suite(file).exit_code, 0);
    auto set = bench::read_results(folder / "out");
    ASSERT_EQ(set.cells.size(), 10U);
    EXPECT_EQ(set.axes.size(), 4U);
    const auto outcome = [&](std::size_t k) { return set.cells.at(k).at("outcome").get<std::string>(); };
    for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(outcome(k), "correct") << set.cells[k];
    EXPECT_EQ(outcome(4), "correct") << set.cells[4];     // off by ½ g t h = 4.9e-4 m
    EXPECT_EQ(outcome(5), "inaccurate") << set.cells[5];  // 4.9e-3 m
    EXPECT_NEAR(set.cells[5].at("figure").get<double>(), 4.905e-3, 1e-9);
    EXPECT_EQ(outcome(6), "correct") << set.cells[6];
    EXPECT_EQ(outcome(7), "correct") << set.cells[7];
    EXPECT_EQ(outcome(8), "correct") << set.cells[8];  // nothing moves
    EXPECT_EQ(outcome(9), "refused") << set.cells[9];
    const std::string summary = content_of(folder / "out" / "summary.md");
    EXPECT_NE(summary.find("### Where methods break"), std::string::npos) << summary;
    const std::string csv = content_of(folder / "out" / "cells.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 11);

    // What was done is not done again, and --only keeps one axis.
    const auto again = bench({"run", file.string(), "-o", (folder / "out").string(), "--only", "fall", "--plugin-path",
                              tests::places::plugins});
    ASSERT_EQ(again.exit_code, 0) << again.errors;
    EXPECT_NE(again.errors.find("4 runs were done before"), std::string::npos) << again.errors;
    set = bench::read_results(folder / "out");
    EXPECT_EQ(set.cells.size(), 4U);
    EXPECT_EQ(set.axes.size(), 1U);
    const auto unknown = bench({"run", file.string(), "-o", (folder / "out").string(), "--only", "fal"});
    EXPECT_EQ(unknown.exit_code, 2);
    EXPECT_NE(unknown.errors.find("has no axis \"fal\"; did you mean \"fall\"?"), std::string::npos) << unknown.errors;
}

// h² K is so large against M there that rounding x alone leaves 1e-6 of ‖Hx‖: no solver's lie, and not solved either.
TEST_F(Axes, StiffnessBeyondDoublePrecisionIsAFailureWithItsReason) {
    ASSERT_EQ(
        run_suite(suite("axes:\n"
                        "  - {name: stiff, generate: elastic_block, set: {elements: 2, layers: 1, young: $(value)},\n"
                        "     values: [1e6, 1e14], bounds: {speed: 1}, solvers: [spg, ssn]}\n"))
            .exit_code,
        0);
    const auto set = bench::read_results(folder / "out");
    ASSERT_EQ(set.cells.size(), 4U);
    for (const std::size_t k : {0U, 2U}) {
        EXPECT_EQ(set.cells[k].at("outcome"), "correct") << set.cells[k];
        EXPECT_EQ(set.cells[k + 1].at("outcome"), "failed") << set.cells[k + 1];
        EXPECT_EQ(set.cells[k + 1].at("status"), "numerical_failure") << set.cells[k + 1];
        EXPECT_NE(set.cells[k + 1].at("sentence").get<std::string>().find("rounding x to double precision"),
                  std::string::npos);
    }
}

}  // namespace
}  // namespace delassus::bench_test::axes_test
