// SPDX-License-Identifier: BSD-3-Clause
// Results before and after a change.
#include "bench/compare_sets.hpp"

#include <gtest/gtest.h>

#include "bench_fixture.hpp"
#include "delassus/error.hpp"

namespace delassus::bench_test::compare_sets_test {
namespace {

using bench::Json;

Json solve(const std::string& solver, std::vector<double> seconds, const std::string& cause = "") {
    Json repeats = Json::array();
    for (const double one : seconds) repeats.push_back({0.25 * one, 0.75 * one});
    return {{"kind", "solve"},
            {"problem", "p"},
            {"law", "associated"},
            {"label", solver},
            {"tolerance", 1e-6},
            {"cause", cause},
            {"seconds", {{"setup", 0.0}, {"solve", 0.0}, {"repeats", repeats}}}};
}

bench::ResultSet set_of(std::vector<Json> solves) {
    bench::ResultSet set;
    set.session = {{"machine", {{"processor", "P"}, {"cores", 2}}},
                   {"settings", {{"time_limit", 1.0}, {"memory_limit", nullptr}, {"max_iterations", 10}}}};
    set.problems.push_back(Json{{"problem", "p"}, {"name", "pile"}});
    set.solves = std::move(solves);
    return set;
}

TEST(CompareSets, RatiosAndWhatChanged) {
    const auto before = set_of({solve("a", {2.0, 3.0}), solve("b", {1.0, 1.5}), solve("c", {1.0})});
    const auto after = set_of({solve("a", {1.0, 1.5}), solve("b", {1.2, 1.3}), solve("c", {1.0}, "crashed")});
    const Json result = bench::compare_sets(before, after, false);
    ASSERT_EQ(result.at("runs").size(), 2U);
    const Json& a = result.at("runs")[0];
    EXPECT_DOUBLE_EQ(a.at("ratio"), 0.5);
    EXPECT_DOUBLE_EQ(a.at("low"), 1.0 / 3.0);
    EXPECT_DOUBLE_EQ(a.at("high"), 0.75);
    EXPECT_EQ(a.at("certain"), true);
    EXPECT_EQ(result.at("runs")[1].at("certain"), false);
    EXPECT_EQ(result.at("solvers")[0].at("faster"), 1);
    EXPECT_EQ(result.at("solvers")[1].at("slower"), 0);
    ASSERT_EQ(result.at("changed").size(), 1U);
    EXPECT_EQ(result.at("changed")[0].at("b"), "crashed");
    EXPECT_EQ(result.at("changed")[0].at("a"), "solved");
    const std::string text = bench::compare_text(result);
    EXPECT_NE(text.find("pile (associated), c, 1e-06: crashed, was solved"), std::string::npos) << text;
    EXPECT_NE(text.find("0.500"), std::string::npos) << text;
}

TEST(CompareSets, IncomparableSetsAreRefused) {
    const auto before = set_of({solve("a", {1.0})});
    auto other = set_of({solve("a", {1.0})});
    other.session["machine"]["processor"] = "Q";
    EXPECT_THROW(static_cast<void>(bench::compare_sets(before, other, false)), InputError);
    EXPECT_NO_THROW(static_cast<void>(bench::compare_sets(before, other, true)));
    auto limits = set_of({solve("a", {1.0})});
    limits.session["settings"]["time_limit"] = 2.0;
    EXPECT_THROW(static_cast<void>(bench::compare_sets(before, limits, false)), InputError);
    EXPECT_THROW(static_cast<void>(bench::compare_sets(before, set_of({solve("z", {1.0})}), false)), InputError);
}

TEST_F(BenchTest, CompareFromOutside) {
    const auto one = suite("problems: [stops]\nsolvers: [misbehaving]\ntolerances: [1e-6]\nrepeats: 2\n");
    ASSERT_EQ(run_suite(one, "a").exit_code, 0);
    ASSERT_EQ(run_suite(one, "b").exit_code, 0);
    const auto run = bench({"compare", (folder / "a").string(), (folder / "b").string(), "--json"});
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const Json result = Json::parse(run.output);
    EXPECT_EQ(result.at("runs").size(), 1U);
    EXPECT_GT(result.at("runs")[0].at("ratio"), 0.0);
    EXPECT_LE(result.at("runs")[0].at("low"), result.at("runs")[0].at("ratio"));
    ASSERT_EQ(run_suite(suite("problems: [friction]\nsolvers: [misbehaving]\nrepeats: 1\n"), "c").exit_code, 0);
    const auto refused = bench({"compare", (folder / "a").string(), (folder / "c").string()});
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.errors.find("no run in common"), std::string::npos) << refused.errors;
}

}  // namespace
}  // namespace delassus::bench_test::compare_sets_test
