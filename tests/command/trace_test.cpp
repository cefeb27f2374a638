// SPDX-License-Identifier: BSD-3-Clause
// DELASSUS_TRACE: what a viewer of Chrome's traces reads.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "support/places.hpp"
#include "support/run_command.hpp"

namespace delassus::tests::trace_test {
namespace {

using Json = nlohmann::json;

CommandResult run_traced(const std::filesystem::path& trace, const std::string& arguments) {
    return run_shell("DELASSUS_TRACE=" + trace.string() + " " + tests::places::command + " " + arguments);
}

/// The spans of a trace, whose list has no end.
std::vector<Json> spans_of(const std::filesystem::path& trace) {
    std::string text = text_of(trace);
    text.erase(text.find_last_of(','));
    std::vector<Json> spans;
    for (const Json& event : Json::parse(text + "]"))
        if (event.at("ph") == "X") spans.push_back(event);
    return spans;
}

std::vector<Json> of_kind(const std::vector<Json>& spans, const std::string& kind) {
    std::vector<Json> result;
    std::copy_if(spans.begin(), spans.end(), std::back_inserter(result),
                 [&](const Json& span) { return span.at("cat") == kind; });
    return result;
}

bool lies_within(const Json& span, const std::vector<Json>& others) {
    const double begin = span.at("ts"), end = begin + span.at("dur").get<double>();
    return std::any_of(others.begin(), others.end(), [&](const Json& other) {
        const double from = other.at("ts");
        return &other != &span && other.at("tid") == span.at("tid") && from <= begin + 1e-3 &&
               end <= from + other.at("dur").get<double>() + 1e-3;
    });
}

TEST(Trace, HasSolvesWithTheirStages) {
    const ScratchFolder scratch;
    const auto trace = scratch / "trace.json";
    const auto solved =
        run_traced(trace, "solve " + example("box_stack") + " --solver 'apgd(finish=ssn,finish_at=1e-2)'");
    ASSERT_EQ(solved.exit_code, 0) << solved.err;
    const auto solves = of_kind(spans_of(trace), "solve"), calls = of_kind(spans_of(trace), "plugin");
    std::vector<std::string> names;
    for (const Json& span : solves) names.push_back(span.at("name"));
    for (const char* stage : {"apgd", "ssn"})
        EXPECT_NE(std::find(names.begin(), names.end(), stage), names.end()) << stage;
    EXPECT_EQ(solves.back().at("args").at("status"), "solved") << "the outer one ends last";
    EXPECT_EQ(solves.back().at("args").at("problem"), "box_stack");
    EXPECT_TRUE(std::all_of(solves.begin(), solves.end() - 1,
                            [&](const Json& span) { return lies_within(span, {solves.back()}); }));
    EXPECT_GE(calls.size(), 4U);
    EXPECT_TRUE(std::all_of(calls.begin(), calls.end(), [&](const Json& span) { return lies_within(span, solves); }));
}

TEST(Trace, HasStepsWithTheirSolves) {
    const ScratchFolder scratch;
    const auto trace = scratch / "trace.json";
    std::ofstream(scratch / "scene.yaml")
        << "step: 0.01\nend: 0.1\nsolver: pgs\nmaterials: {m: {friction: 0.3}}\nbodies:\n"
           "  - {name: slope, fixed: true, shapes: [{plane: {}, material: m}]}\n"
           "  - {name: box, density: 1000, position: [0, 0, 0.05], velocity: [1, 0, 0],\n"
           "     shapes: [{box: {size: [0.2, 0.2, 0.1]}, material: m}]}\n";
    const std::string line = "run " + (scratch / "scene.yaml").string() + " -o " + (scratch / "out").string();
    for (int time = 0; time < 2; ++time) {  // a trace is replaced by the next one
        const auto run = run_traced(trace, line);
        ASSERT_EQ(run.exit_code, 0) << run.err;
        const auto steps = of_kind(spans_of(trace), "step"), solves = of_kind(spans_of(trace), "solve");
        ASSERT_EQ(steps.size(), 10U);
        EXPECT_EQ(steps.back().at("args").at("number"), 10);
        EXPECT_GE(solves.size(), 10U);
        EXPECT_TRUE(
            std::all_of(solves.begin(), solves.end(), [&](const Json& span) { return lies_within(span, steps); }));
    }
    std::ofstream(trace) << "a diary\n";
    const auto refused = run_traced(trace, line);
    EXPECT_EQ(refused.exit_code, 0) << refused.err;
    EXPECT_NE(refused.err.find("is not written: the file exists, and delassus did not write it"), std::string::npos)
        << refused.err;
    EXPECT_EQ(text_of(trace), "a diary\n");
}

TEST(Trace, HasWhatOtherProcessesDo) {
    const ScratchFolder scratch;
    const auto trace = scratch / "trace.json";
    const auto compared = run_traced(
        trace, "compare " + example("box_stack") + " --solvers pgs,apgd --repeats 1 -o " + (scratch / "out").string());
    ASSERT_EQ(compared.exit_code, 0) << compared.err;
    std::vector<std::string> names;
    for (const Json& span : of_kind(spans_of(trace), "solve")) names.push_back(span.at("name"));
    for (const char* solver : {"pgs", "apgd"})
        EXPECT_NE(std::find(names.begin(), names.end(), solver), names.end()) << solver;
}

}  // namespace
}  // namespace delassus::tests::trace_test
