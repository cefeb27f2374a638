// SPDX-License-Identifier: BSD-3-Clause
// Misbehaving plugins through `delassus`: one sentence on standard error and the exit code, whatever they do.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "delassus/problem_files.hpp"
#include "helpers.hpp"

namespace delassus::command_test {
namespace {

using test::fixture;
using test::run_command;

class Command : public testing::Test {
protected:
    void SetUp() override { write_problem(test::known_problem("friction_diagonal_associated").problem, problem()); }
    [[nodiscard]] std::filesystem::path problem() const { return folder_.path() / "problem"; }

    test::CommandResult solve(const std::string& plugin, std::vector<std::string> more = {}) {
        std::vector<std::string> arguments{"solve", problem().string(), "--solver", fixture(plugin).string()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_command(arguments);
    }

    test::TemporaryFolder folder_;
};

TEST_F(Command, SolvesWithAPluginByPath) {
    const auto result = solve("sweeps", {"--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const auto json = nlohmann::json::parse(result.out);
    EXPECT_EQ(json.at("status"), "solved");
    EXPECT_LE(json.at("error").at("natural").get<double>(), 1e-8);
}

TEST_F(Command, CrashInSolveIsASentence) {
    const auto result = solve("crashes_in_solve");
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_NE(result.err.find("crashes_in_solve"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("crashed: a segmentation fault"), std::string::npos) << result.err;
    EXPECT_TRUE(result.out.empty()) << result.out;
}

TEST_F(Command, CrashAtLoadIsASentence) {
    for (const auto& result : {solve("crashes_at_load"), run_command({"plugins", "info", fixture("crashes_at_load")}),
                               run_command({"plugins", "describe", fixture("crashes_at_load")})}) {
        EXPECT_EQ(result.exit_code, 3);
        EXPECT_NE(result.err.find("crashed: a segmentation fault"), std::string::npos) << result.err;
    }
}

TEST_F(Command, HangIsEndedByTheTimeLimit) {
    for (const char* plugin : {"hangs", "hangs_with_progress"}) {
        const auto result = solve(plugin, {"--time-limit", "0.1"});
        EXPECT_EQ(result.exit_code, 3);
        EXPECT_NE(result.err.find("did not answer"), std::string::npos) << result.err;
        EXPECT_NE(result.err.find(plugin), std::string::npos) << result.err;
        EXPECT_LT(result.seconds, 20.0);
    }
}

TEST_F(Command, PrintingDoesNotReachTheReport) {
    const auto result = solve("prints", {"--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(nlohmann::json::parse(result.out).at("status"), "solved");
    EXPECT_NE(result.err.find("to standard output"), std::string::npos) << result.err;
}

TEST_F(Command, OutcomesHaveTheirExitCode) {
    const std::tuple<const char*, int, const char*> cases[] = {
        {"returns_nan", 3, "not finite"},
        {"claims_falsely", 3, "claimed convergence"},
        {"throws_in_solve", 3, "thrown in solve"},
        {"fails_to_factorize", 3, "the pivot vanished"},
        {"throws_in_create", 2, "thrown in create"},
        {"wrong_abi", 2, "version 99"},
        {"missing_symbol", 2, "not a Delassus plugin"},
        {"direct", 4, "friction cones"},
    };
    for (const auto& [plugin, code, words] : cases) {
        const auto result = solve(plugin);
        EXPECT_EQ(result.exit_code, code) << plugin << ": " << result.err;
        EXPECT_NE((result.out + result.err).find(words), std::string::npos) << plugin << ": " << result.err;
    }
}

TEST_F(Command, CheckHasItsExitCode) {
    const auto good = run_command({"plugins", "check", fixture("sweeps")});
    EXPECT_EQ(good.exit_code, 0) << good.out << good.err;
    EXPECT_NE(good.out.find("sweeps conforms"), std::string::npos) << good.out;
    const auto bad = run_command({"plugins", "check", fixture("crashes_at_load")});
    EXPECT_EQ(bad.exit_code, 3);
    EXPECT_NE(bad.out.find("crashed: segmentation fault"), std::string::npos) << bad.out;
    const auto json = run_command({"plugins", "check", fixture("minimal"), "--json"});
    EXPECT_EQ(json.exit_code, 3);
    EXPECT_EQ(nlohmann::json::parse(json.out).at("plugin"), "minimal");
}

}  // namespace
}  // namespace delassus::command_test
