// SPDX-License-Identifier: BSD-3-Clause
// `delassus compare` from outside: exit codes, the table, the files.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "bench/compare.hpp"
#include "bench_fixture.hpp"
#include "delassus/error.hpp"
#include "support/places.hpp"

namespace delassus::bench_test::compare_test {
namespace {

using Json = nlohmann::json;

constexpr const char* three = "misbehaving,misbehaving(behaviour=crash),misbehaving(behaviour=lie)";

/// The fields of each record, by RFC 4180.
std::vector<std::vector<std::string>> records_of(const std::string& text) {
    std::vector<std::vector<std::string>> records;
    std::vector<std::string> record = {""};
    bool quoted = false;
    for (std::size_t k = 0; k < text.size(); ++k) {
        const char c = text[k];
        if (quoted && c == '"' && k + 1 < text.size() && text[k + 1] == '"') {
            record.back() += c;
            ++k;
        } else if (c == '"') {
            quoted = !quoted;
        } else if (!quoted && c == ',') {
            record.emplace_back();
        } else if (!quoted && c == '\n') {
            records.push_back(std::move(record));
            record = {""};
        } else if (quoted || c != '\r') {
            record.back() += c;
        }
    }
    return records;
}

TEST_F(BenchTest, ComparesAndWritesTheFiles) {
    const auto run = compare({(folder / "stops").string(), "--solvers", three, "--repeats", "2"});
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    EXPECT_EQ(run.errors, "");
    for (const char* word : {"stops: n = 0, m = 3", "solved", "crashed", "false_claim", "report.html"})
        EXPECT_NE(run.output.find(word), std::string::npos) << run.output;

    const Json json = Json::parse(content_of(folder / "out" / "results.json"));
    EXPECT_EQ(json["format"], "delassus-comparison");
    EXPECT_EQ(json["version"], 1);
    EXPECT_FALSE(json["interrupted"]);
    EXPECT_GE(json["machine"]["cores"], 1);
    EXPECT_NE(json["command"].get<std::string>().find("compare --plugin-path"), std::string::npos);
    const Json& rows = json["problems"][0]["results"];
    ASSERT_EQ(rows.size(), 3U);
    EXPECT_EQ(rows[0]["status"], "solved");
    EXPECT_EQ(rows[0]["seconds"]["repeats"].size(), 2U);
    EXPECT_GT(rows[0]["curve"]["samples"].size(), 2U);
    EXPECT_EQ(rows[1]["status"], "crashed");
    EXPECT_TRUE(rows[1]["error"].is_null());
    EXPECT_EQ(rows[2]["status"], "false_claim");
    EXPECT_GT(rows[2]["error"]["natural"], 0.1);

    const auto records = records_of(content_of(folder / "out" / "results.csv"));
    ASSERT_EQ(records.size(), 4U);
    const auto column = [&](const char* name) {
        return std::find(records[0].begin(), records[0].end(), name) - records[0].begin();
    };
    for (const auto& record : records) EXPECT_EQ(record.size(), records[0].size());
    EXPECT_EQ(records[1][column("solver")], "misbehaving");
    EXPECT_EQ(records[2][column("solver")], "misbehaving(behaviour=crash)");
    EXPECT_EQ(records[2][column("natural")], "");
    EXPECT_EQ(std::stod(records[3][column("natural")]), rows[2]["error"]["natural"].get<double>());
    EXPECT_EQ(std::stod(records[1][column("solve_s")]), rows[0]["seconds"]["solve"].get<double>());
    EXPECT_EQ(records[1].back(), "");
}

TEST_F(BenchTest, JsonReplacesTheTable) {
    const auto run = compare({(folder / "stops").string(), "--solvers", "misbehaving", "--json"});
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_EQ(Json::parse(run.output)["problems"][0]["results"][0]["status"], "solved");
}

TEST_F(BenchTest, ExitCodeThreeIfAProblemStaysUnsolved) {
    const auto run = compare({(folder / "stops").string(), (folder / "friction").string(), "--solvers", "misbehaving"});
    EXPECT_EQ(run.exit_code, 3);
    EXPECT_NE(run.output.find("misbehaving cannot solve \"friction\""), std::string::npos) << run.output;
}

TEST_F(BenchTest, BadInputIsRefusedBeforeAnythingRuns) {
    const std::string stops = (folder / "stops").string();
    const std::map<std::string, std::vector<std::string>> cases = {
        {"there is no solver \"misbehavin\"; did you mean \"misbehaving\"?",
         {stops, "--solvers", "misbehaving,misbehavin"}},
        {"misbehaving has no option \"behavior\"; did you mean \"behaviour\"?",
         {stops, "--solvers", "misbehaving(behavior=crash)"}},
        {"cannot be \"dance\"", {stops, "--solvers", "misbehaving(behaviour=dance)"}},
        {"is listed twice", {stops, "--solvers", "misbehaving,misbehaving"}},
        {"there is no plugin ./absent.so", {stops, "--solvers", "./absent.so"}},
        {"absent", {stops, (folder / "absent").string(), "--solvers", "misbehaving"}},
        {"the tolerance is 0", {stops, "--tolerance", "0"}},
        {"the time limit is", {stops, "--time-limit", "inf"}},
        {"the number of repeats is 0", {stops, "--repeats", "0"}},
        {"--jobs must be 1", {stops, "--jobs", "2"}},
        {"coulomb", {stops, "--law", "sticky"}}};
    for (const auto& [sentence, arguments] : cases) {
        const auto run = compare(arguments);
        EXPECT_EQ(run.exit_code, 2) << sentence;
        EXPECT_NE(run.errors.find(sentence), std::string::npos) << run.errors;
        EXPECT_EQ(std::count(run.errors.begin(), run.errors.end(), '\n'), 1) << run.errors;
        EXPECT_EQ(run.output, "");
        EXPECT_FALSE(fs::exists(folder / "out" / "results.json"));
    }
}

TEST_F(BenchTest, AnInterruptLeavesTableAndFiles) {
    ChildSettings child;
    child.program = tests::places::command;
    child.arguments = {"compare",
                       (folder / "stops").string(),
                       "--plugin-path",
                       tests::places::plugins,
                       "-o",
                       (folder / "out").string(),
                       "--solvers",
                       "misbehaving,misbehaving(behaviour=slow),misbehaving(behaviour=lie)",
                       "--repeats",
                       "1"};
    child.timeout = 60.0;
    child.cancel_grace = 30.0;
    child.cancelled = [&] { return fs::exists(at_work()); };
    const auto run = run_child(child);
    EXPECT_EQ(run.exit_code, 3) << run.errors;
    EXPECT_NE(run.output.find("cancelled"), std::string::npos) << run.output;
    const Json json = Json::parse(content_of(folder / "out" / "results.json"));
    EXPECT_TRUE(json["interrupted"]);
    const Json& rows = json["problems"][0]["results"];
    ASSERT_EQ(rows.size(), 2U);  // the third never began
    EXPECT_EQ(rows[0]["status"], "solved");
    EXPECT_EQ(rows[1]["status"], "cancelled");
    EXPECT_TRUE(fs::exists(folder / "out" / "results.csv"));
}

TEST_F(BenchTest, VelocitiesAreComparedWithTheMostAccurate) {
    // H = 2 I, D = I, λ ≥ 0: no plugin of the tests takes it, so the folders are written by hand.
    Problem block;
    block.name = "block";
    block.H = SparseMatrix::from_triplets(2, 2, {{0, 0, 2.0}, {1, 1, 8.0}});
    block.D = SparseMatrix::from_triplets(1, 2, {{0, 0, 1.0}});
    block.a = {1.0, 0.0};
    block.b = {0.0};
    block.cones = {Cone::nonnegative(1)};
    write_problem(block, folder / "block");
    write_solution({{1.0, 0.5}, {0.0}}, {}, folder / "best");
    write_solution({{1.0, 1.0}, {0.0}}, {}, folder / "other");
    const auto errors = bench::velocity_errors(worker(), folder / "block", folder / "best",
                                               {folder / "best", folder / "absent", folder / "other"});
    ASSERT_EQ(errors.size(), 3U);
    EXPECT_EQ(errors[0], 0.0);
    EXPECT_TRUE(std::isnan(errors[1]));
    EXPECT_NEAR(errors[2], std::sqrt(2.0 / 4.0), 1e-14);  // √(8·0.5²) / √(2·1² + 8·0.5²)
}

TEST(ShellLine, QuotesWhatAShellWouldTouch) {
    EXPECT_EQ(bench::shell_line({"delassus", "a(b=c)", "it's", ""}), "delassus 'a(b=c)' 'it'\\''s' ''");
}

}  // namespace
}  // namespace delassus::bench_test::compare_test
