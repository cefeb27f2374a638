// SPDX-License-Identifier: BSD-3-Clause
// `delassus bench run` from outside: rows, causes, resuming, limits.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "bench/analysis.hpp"
#include "bench/results_file.hpp"
#include "bench/rows.hpp"
#include "bench_fixture.hpp"
#include "delassus/error.hpp"
#include "delassus/generate.hpp"
#include "support/places.hpp"

namespace delassus::bench_test::bench_run_test {
namespace {

using bench::Json;

class BenchRun : public BenchTest {
protected:
    [[nodiscard]] bench::ResultSet results(const std::string& output = "out") const {
        return bench::read_results(folder / output);
    }
    /// Rows by "solver at tolerance".
    [[nodiscard]] static std::map<std::string, Json> by_run(const bench::ResultSet& set) {
        std::map<std::string, Json> rows;
        for (const Json& row : set.solves) rows[fmt_key(row.at("label"), row.at("tolerance").get<double>())] = row;
        return rows;
    }
    static std::string fmt_key(const std::string& label, double tolerance) {
        std::ostringstream text;
        text << label << " at " << tolerance;
        return text.str();
    }
    [[nodiscard]] std::size_t lines(const std::string& kind) const {
        std::istringstream stream(content_of(folder / "out" / "results.jsonl"));
        std::size_t count = 0;
        for (std::string line; std::getline(stream, line);) count += Json::parse(line).at("kind") == kind;
        return count;
    }
};

TEST_F(BenchRun, LawsAreForProblemsWithFriction) {
    const auto run =
        run_suite(suite("problems: [stops, friction]\nsolvers: [pgs]\nlaws: [associated, coulomb]\n"
                        "tolerances: [1e-3]\nrepeats: 1\nreferences: none\n"));
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const auto set = results();
    std::map<std::string, int> runs;
    for (const Json& row : set.solves) ++runs[row.at("problem").get<std::string>()];
    EXPECT_EQ(runs.at(set.problems.at(0).at("problem")), 1);
    EXPECT_EQ(runs.at(set.problems.at(1).at("problem")), 2);
}

TEST_F(BenchRun, EveryFailureIsARowWithItsCause) {
    const auto run =
        run_suite(suite("problems: [stops, friction]\n"
                        "solvers:\n"
                        "  - {name: misbehaving, behaviour: [solve, lie, crash, hang, slow, throw, exit]}\n"
                        "tolerances: [1e-6]\n"
                        "time_limit: 0.3\n"
                        "repeats: 2\n"));
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const auto set = results();
    EXPECT_EQ(set.missing, 0U);
    std::map<std::string, std::string> causes;
    for (const Json& row : set.solves) {
        const bool stops = row.at("problem") == set.problems.at(0).at("problem");
        causes[(stops ? "" : "friction ") + row.at("options").at("behaviour").get<std::string>()] = row.at("cause");
    }
    EXPECT_EQ(causes.at("solve"), "");
    EXPECT_EQ(causes.at("lie"), "false_claim");
    EXPECT_EQ(causes.at("crash"), "crashed");
    EXPECT_EQ(causes.at("exit"), "crashed");
    EXPECT_EQ(causes.at("hang"), "time_limit");
    EXPECT_EQ(causes.at("slow"), "time_limit");
    EXPECT_EQ(causes.at("throw"), "error");
    EXPECT_EQ(causes.at("friction solve"), "unsupported");
    const Json& solved = set.solves[0];
    EXPECT_EQ(solved.at("seconds").at("repeats").size(), 2U);
    EXPECT_GT(solved.at("peak_memory"), 0);

    const std::string summary = content_of(folder / "out" / "summary.md");
    EXPECT_NE(summary.find("**FALSE CLAIM**: misbehaving(behaviour=lie) (1)"), std::string::npos) << summary;
    EXPECT_NE(run.output.find("FALSE CLAIM"), std::string::npos);
    const std::string csv = content_of(folder / "out" / "results.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 15);
    const Json& session = set.session;
    EXPECT_EQ(session.at("format"), "delassus-bench");
    EXPECT_EQ(session.at("version"), 1);
    EXPECT_NE(session.at("command").get<std::string>().find("bench run"), std::string::npos);
    EXPECT_FALSE(session.at("build").at("compiler").get<std::string>().empty());
    ASSERT_FALSE(set.libraries.empty());
    EXPECT_NE(set.libraries.at(0).at("files").dump().find("libdelassus.so.0."), std::string::npos);
}

TEST_F(BenchRun, WhatFailedIsNotRunToATighterTolerance) {
    const std::string text =
        "problems: [stops, friction]\n"
        "solvers:\n"
        "  - {name: misbehaving, behaviour: [slow, crash, lie]}\n"
        "tolerances: [1e-9, 1e-3, 1e-6]\n"
        "time_limit: 0.3\n"
        "repeats: 1\n"
        "references: none\n";
    ASSERT_EQ(run_suite(suite(text)).exit_code, 0);
    auto set = results();
    ASSERT_EQ(set.solves.size(), 18U);
    const auto row = [&](std::size_t problem, const std::string& behaviour, double tolerance) {
        for (const Json& one : set.solves)
            if (one.at("problem") == set.problems.at(problem).at("problem") && one.at("tolerance") == tolerance &&
                one.at("options").at("behaviour") == behaviour)
                return one;
        return Json();
    };
    EXPECT_FALSE(row(0, "slow", 1e-3).contains("skipped_after"));
    for (const double tolerance : {1e-6, 1e-9}) {
        const Json slow = row(0, "slow", tolerance);
        EXPECT_EQ(slow.at("cause"), "time_limit");
        EXPECT_EQ(slow.at("skipped_after"), 1e-3);
        EXPECT_EQ(slow.at("message"), "not run: ended with time limit at 0.001 already");
        EXPECT_TRUE(slow.at("error").is_null());
        EXPECT_EQ(row(1, "slow", tolerance).at("cause"), "unsupported");  // refused once, whatever the tolerance
        EXPECT_TRUE(row(1, "slow", tolerance).contains("skipped_after"));
        for (const char* defect : {"crash", "lie"})  // each is looked at
            EXPECT_FALSE(row(0, defect, tolerance).contains("skipped_after"));
    }
    EXPECT_NE(content_of(folder / "out" / "summary.md").find("misbehaving(behaviour=slow) (3, 2 of them not run)"),
              std::string::npos);

    // A suite that leaves none out runs those that were; the others are kept.
    ASSERT_EQ(run_suite(suite(text + "skip_after_failure: false\n")).exit_code, 0);
    set = results();
    EXPECT_EQ(lines("solve"), 18U + 8U);
    EXPECT_FALSE(row(0, "slow", 1e-9).contains("skipped_after"));
    EXPECT_EQ(row(0, "slow", 1e-9).at("cause"), "time_limit");
}

TEST_F(BenchRun, LeavingOutIsMeasured) {
    for (const char* scene : {"pendulum", "bouncing_ball"})
        std::ofstream(folder / (std::string(scene) + ".yaml"))
            << content_of(fs::path(tests::places::source) / "examples/scenes" / (std::string(scene) + ".yaml"));
    const auto run =
        run_suite(suite("leaving_out:\n"
                        "  - {path: pendulum.yaml, end: 0.2}\n"
                        "  - {path: bouncing_ball.yaml, end: 0.6}\n"
                        "repeats: 1\n"));
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const auto set = results();
    ASSERT_EQ(set.leaving_out.size(), 2U);
    const auto has = [](const Json& side, const std::string& part) {
        return std::any_of(side.at("libraries").begin(), side.at("libraries").end(),
                           [&](const Json& file) { return file.get<std::string>().find(part) != std::string::npos; });
    };
    for (const Json& row : set.leaving_out) {
        EXPECT_EQ(row.at("as_is").at("status"), "finished") << row;
        EXPECT_EQ(row.at("forced").at("status"), "finished") << row;
        EXPECT_LT(row.at("forced").at("error").at("position"), 1e-5) << row;  // the same physics
        EXPECT_TRUE(has(row.at("forced"), "delassus_collision"));
    }
    const Json &pendulum = set.leaving_out[0], &ball = set.leaving_out[1];
    EXPECT_FALSE(has(pendulum.at("as_is"), "delassus_collision"));
    EXPECT_FALSE(pendulum.at("left_out").empty());
    EXPECT_GT(ball.at("as_is").at("totals").at("most_rows"), 0);
    EXPECT_EQ(ball.at("forced").at("totals").at("most_rows").get<int>(),
              3 * ball.at("as_is").at("totals").at("most_rows").get<int>());
    EXPECT_NE(run.output.find("What leaving out saves"), std::string::npos);
    // Nothing of it is run again.
    EXPECT_NE(run_suite(folder / "suite.yaml").errors.find("2 runs were done before"), std::string::npos);
}

TEST_F(BenchRun, MemoryBeyondTheLimitIsKilledAndSaid) {
#if defined(__SANITIZE_ADDRESS__)
    GTEST_SKIP() << "the address sanitizer itself takes more memory than the limit";
#endif
    const auto run =
        run_suite(suite("problems: [stops]\n"
                        "solvers: [misbehaving(behaviour=eat), misbehaving]\n"
                        "tolerances: [1e-6]\n"
                        "memory_limit: 200\n"
                        "repeats: 1\n"));
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const auto set = results();
    ASSERT_EQ(set.solves.size(), 2U);
    EXPECT_EQ(set.solves[0].at("cause"), "memory");
    EXPECT_NE(set.solves[0].at("message").get<std::string>().find("more than its 200 MiB"), std::string::npos);
    EXPECT_GT(set.solves[0].at("peak_memory"), 200 << 20);
    EXPECT_LT(set.solves[0].at("peak_memory"), 1000 << 20);  // it was not let go on to its 4 GiB
    EXPECT_EQ(set.solves[1].at("cause"), "");
}

TEST_F(BenchRun, AnInterruptedRunGoesOn) {
    const auto file = suite(
        "problems: [stops]\n"
        "solvers: [misbehaving, misbehaving(behaviour=lie), misbehaving(behaviour=crash)]\n"
        "tolerances: [1e-3, 1e-6]\n"
        "repeats: 1\n");
    ASSERT_EQ(run_suite(file).exit_code, 0);
    ASSERT_EQ(results().solves.size(), 6U);

    // As if it had been killed while it wrote its fifth row.
    std::istringstream stream(content_of(folder / "out" / "results.jsonl"));
    std::string kept;
    int rows = 0;
    for (std::string line; std::getline(stream, line);) {
        if (Json::parse(line).at("kind") == "solve" && ++rows == 5) {
            kept += line.substr(0, line.size() / 2);
            break;
        }
        kept += line + "\n";
    }
    std::ofstream(folder / "out" / "results.jsonl", std::ios::binary) << kept;
    const auto broken = results();
    EXPECT_EQ(broken.solves.size(), 4U);
    EXPECT_EQ(broken.missing, 2U);
    EXPECT_NE(bench({"report", (folder / "out").string()}).output.find("2 runs are missing"), std::string::npos);
    const Json first = broken.solves[0];

    const auto again = run_suite(file);
    EXPECT_EQ(again.exit_code, 0) << again.errors;
    EXPECT_NE(again.errors.find("4 runs were done before"), std::string::npos) << again.errors;
    const auto whole = results();
    EXPECT_EQ(whole.missing, 0U);
    ASSERT_EQ(whole.solves.size(), 6U);
    EXPECT_EQ(whole.solves[0], first);  // not measured again
    EXPECT_EQ(lines("solve"), 6U);

    // A run that the suite no longer asks for is not in the report, and one that is new is run.
    ASSERT_EQ(
        run_suite(suite("problems: [stops]\nsolvers: [misbehaving]\ntolerances: [1e-3, 1e-9]\nrepeats: 1\n")).exit_code,
        0);
    EXPECT_EQ(results().solves.size(), 2U);
    EXPECT_EQ(lines("solve"), 7U);
    // What a row depends on is in its key: more repeats are measured anew.
    ASSERT_EQ(run_suite(suite("problems: [stops]\nsolvers: [misbehaving]\ntolerances: [1e-3]\nrepeats: 2\n")).exit_code,
              0);
    EXPECT_EQ(lines("solve"), 8U);
}

TEST_F(BenchRun, CtrlCEndsItWithWhatThereIs) {
    ChildSettings child;
    child.program = tests::places::command;
    const auto file = suite(
        "problems: [stops]\nsolvers: [misbehaving, misbehaving(behaviour=slow)]\ntolerances: [1e-6]\ntime_limit: "
        "60\nrepeats: 1\n");
    child.arguments = {
        "bench", "run", file.string(), "-o", (folder / "out").string(), "--plugin-path", tests::places::plugins};
    child.timeout = 60.0;
    child.cancel_grace = 30.0;
    child.cancelled = [&] { return fs::exists(at_work()); };
    const auto run = run_child(child);
    EXPECT_EQ(run.exit_code, 3) << run.errors;
    EXPECT_EQ(results().solves.size(), 1U);
    EXPECT_EQ(results().missing, 1U);
    EXPECT_NE(content_of(folder / "out" / "summary.md").find("Not complete"), std::string::npos);
}

TEST_F(BenchRun, ReferencesAreConfirmedAndCached) {
    const auto file = suite(
        "problems: [{generate: sphere_pile, set: {contacts: 20}}]\n"
        "solvers: [apgd, pgs]\n"
        "tolerances: [1e-3, 1e-9]\n"
        "repeats: 1\n");
    ASSERT_EQ(run_suite(file).exit_code, 0);
    auto set = results();
    ASSERT_EQ(set.references.size(), 1U);
    const Json reference = set.references[0];
    EXPECT_EQ(reference.at("found"), true);
    EXPECT_EQ(reference.at("confirmed"), true) << reference;
    EXPECT_LT(reference.at("natural"), 1e-9);
    EXPECT_LT(reference.at("second").at("difference"), 1e-6);
    EXPECT_NE(reference.at("second").at("solver"), reference.at("solver"));
    EXPECT_EQ(reference.at("cached"), false);
    const auto rows = by_run(set);
    const double loose = rows.at("apgd at 0.001").at("error").at("velocity");
    const double tight = rows.at("apgd at 1e-09").at("error").at("velocity");
    EXPECT_LT(tight, 1e-6);
    EXPECT_LT(tight, loose);

    fs::remove_all(folder / "out");
    ASSERT_EQ(run_suite(file).exit_code, 0);
    set = results();
    EXPECT_EQ(set.references.at(0).at("cached"), true);
    EXPECT_EQ(by_run(set).at("apgd at 1e-09").at("error").at("velocity").get<double>(), tight);
}

TEST_F(BenchRun, TimesteppersConvergeAtTheirOrder) {
    std::ofstream(folder / "pendulum.yaml")
        << content_of(fs::path(tests::places::source) / "examples/scenes/pendulum.yaml");
    const auto run =
        run_suite(suite("scenes: [{path: pendulum.yaml, end: 0.5, steps: [0.02, 0.01, 0.005]}]\n"
                        "timesteppers: [euler_implicit_linearized, generalized_alpha, euler_explicit]\n"
                        "references: {timestepper: generalized_alpha, step_fraction: 0.05}\n"
                        "repeats: 1\n"));
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const auto set = results();
    ASSERT_EQ(set.simulations.size(), 9U);
    EXPECT_EQ(set.simulations[8].at("cause"), "unsupported");  // it takes no joint
    const auto ratio = [&](std::size_t coarse) {
        return set.simulations[coarse].at("error").at("position").get<double>() /
               set.simulations[coarse + 1].at("error").at("position").get<double>();
    };
    EXPECT_NEAR(ratio(1), 2.0, 0.3);  // order 1
    EXPECT_NEAR(ratio(4), 4.0, 0.8);  // order 2
    ASSERT_EQ(set.scenes.size(), 1U);
    EXPECT_FALSE(set.scenes[0].at("plan").at(0).at("left_out").empty());
    EXPECT_TRUE(fs::exists(folder / "out" / "simulations.csv"));
}

TEST_F(BenchRun, StepsOfScenesAreProblems) {
    std::ofstream(folder / "incline.yaml")
        << content_of(fs::path(tests::places::source) / "examples/scenes/box_on_incline.yaml");
    const auto run = run_suite(
        suite("problems: [{scene: incline.yaml, end: 0.01, every: 5}]\nsolvers: [pgs]\ntolerances: [1e-3]\nrepeats: 1\n"
              "references: none\n"));
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    ASSERT_FALSE(results().problems.empty());
    EXPECT_NE(results().problems[0].at("name").get<std::string>().find("incline: "), std::string::npos);
    EXPECT_TRUE(results().references.empty());
}

TEST_F(BenchRun, EqualContentIsRunOnce) {
    fs::copy(folder / "stops", folder / "twin", fs::copy_options::recursive);
    ASSERT_EQ(
        run_suite(suite("problems: [stops, twin]\nsolvers: [misbehaving]\ntolerances: [1e-3]\nrepeats: 1\n")).exit_code,
        0);
    EXPECT_EQ(results().problems.size(), 1U);
}

TEST_F(BenchRun, FamiliesHaveAnExponent) {
    ASSERT_EQ(run_suite(suite("problems: [{generate: sphere_pile, set: {contacts: [20, 60, 180]}}]\nsolvers: [apgd]\n"
                              "tolerances: [1e-3]\nrepeats: 2\nreferences: none\n"))
                  .exit_code,
              0);
    const std::string summary = content_of(folder / "out" / "summary.md");
    EXPECT_NE(summary.find("Growth of cost with size"), std::string::npos) << summary;
    EXPECT_NE(summary.find("| sphere_pile |"), std::string::npos) << summary;
}

TEST_F(BenchRun, SizesAreToldApart) {
    ASSERT_EQ(run_suite(suite("problems: [{generate: sphere_pile, set: {contacts: [20, 60, 180]}}]\nsolvers: [apgd, "
                              "misbehaving]\ntolerances: [1e-3, 1e-6]\nrepeats: 1\nreferences: none\n"))
                  .exit_code,
              0);
    const Json sizes = bench::analyse(results()).at("classes").at(0).at("sizes");
    ASSERT_EQ(sizes.size(), 2U);
    EXPECT_EQ(sizes.at(0).at("from"), 10.0);
    EXPECT_EQ(sizes.at(0).at("problems"), 2);
    EXPECT_EQ(sizes.at(1).at("problems"), 1);
    EXPECT_EQ(sizes.at(1).at("tolerances").size(), 2U);
    const std::string summary = content_of(folder / "out" / "summary.md");
    EXPECT_NE(summary.find("#### By size"), std::string::npos) << summary;
    EXPECT_NE(summary.find("| 10 to 99         |   apgd |       2 of 2 |"), std::string::npos) << summary;
    EXPECT_NE(summary.find("| 100 to 999       |   apgd |       1 of 1 |"), std::string::npos) << summary;
}

TEST_F(BenchRun, WhatIsNoResultIsRefused) {
    EXPECT_EQ(bench({"report", folder.string()}).exit_code, 2);
    fs::create_directories(folder / "out");
    std::ofstream(folder / "out" / "results.jsonl")
        << "{\"kind\": \"session\", \"format\": \"delassus-bench\", \"version\": 99}\n";
    const auto run = bench({"report", (folder / "out").string()});
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_NE(run.errors.find("the format is delassus-bench 99; this version reads delassus-bench 1"),
              std::string::npos)
        << run.errors;
    EXPECT_EQ(run_suite(suite("problems: [stops]\nsolvers: [misbehaving]\n")).exit_code, 2);
}

TEST(Cause, DivergedIsNotALimit) {
    bench::Measurement row;
    row.status = "iteration_limit";
    row.error = Errors{};
    row.error->natural = 1e-3;
    EXPECT_EQ(bench::cause_of(row), "iteration_limit");
    row.error->natural = 1e5;
    EXPECT_EQ(bench::cause_of(row), "diverged");
    row.status = "false_claim";
    EXPECT_EQ(bench::cause_of(row), "false_claim");
    row.status = "hung";
    EXPECT_EQ(bench::cause_of(row), "time_limit");
}

}  // namespace
}  // namespace delassus::bench_test::bench_run_test
