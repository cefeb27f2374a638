// SPDX-License-Identifier: BSD-3-Clause
// The suite passes plugins that keep the rules, and finds the one rule that each misbehaving plugin breaks.
#include "check/conformance.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "helpers.hpp"

namespace delassus::check::conformance_test {
namespace {

using Verdict = CheckResult::Verdict;

std::string failures_of(const ConformanceReport& report) {
    std::string text;
    for (const auto& result : report.results)
        if (result.verdict == Verdict::Failed) text += result.name + ": " + result.detail + "\n";
    return text;
}

const CheckResult* result_of(const ConformanceReport& report, const std::string& name) {
    for (const auto& result : report.results)
        if (result.name == name) return &result;
    return nullptr;
}

/// The suite fails the plugin in this check, with these words.
void expect_failure(const ConformanceReport& report, const std::string& check, const std::string& words) {
    EXPECT_FALSE(report.passed());
    const auto* result = result_of(report, check);
    ASSERT_NE(result, nullptr) << check;
    EXPECT_EQ(result->verdict, Verdict::Failed) << check << ": " << result->detail;
    EXPECT_NE(result->detail.find(words), std::string::npos) << result->detail;
}

/// The same, and nothing else failed.
void expect_only_failure(const ConformanceReport& report, const std::string& check, const std::string& words) {
    expect_failure(report, check, words);
    EXPECT_EQ(report.count(Verdict::Failed), 1u) << failures_of(report);
}

TEST(Conformance, IterativePluginThatKeepsTheRulesPasses) {
    const auto report = run_conformance(test::fixture("sweeps"));
    EXPECT_TRUE(report.passed()) << failures_of(report);
    EXPECT_EQ(report.plugin, "sweeps");
    for (const char* check :
         {"known/friction_diagonal_coulomb", "known/box_reduced", "reuse/warm_start", "reuse/right_hand_sides",
          "instances/threads", "progress/cancel", "progress/time_limit", "options/ranges", "output/quiet"}) {
        const auto* result = result_of(report, check);
        ASSERT_NE(result, nullptr) << check;
        EXPECT_EQ(result->verdict, Verdict::Passed) << check << ": " << result->detail;
    }
    EXPECT_EQ(result_of(report, "known/free_indefinite")->verdict, Verdict::Skipped);
}

TEST(Conformance, DirectPluginThatKeepsTheRulesPasses) {
    const auto report = run_conformance(test::fixture("direct"));
    EXPECT_TRUE(report.passed()) << failures_of(report);
    for (const char* check : {"known/free_semidefinite", "known/free_indefinite", "known/free_unsymmetric",
                              "known/free_redundant", "failure/inconsistent", "failure/singular"}) {
        const auto* result = result_of(report, check);
        ASSERT_NE(result, nullptr) << check;
        EXPECT_EQ(result->verdict, Verdict::Passed) << check << ": " << result->detail;
    }
    EXPECT_EQ(result_of(report, "progress/cancel")->verdict, Verdict::Skipped);
}

TEST(Conformance, PluginInCThatRefusesWhatItDeclaresFailsInThatAlone) {
    const auto report = run_conformance(test::fixture("minimal"));
    expect_only_failure(report, "capabilities/shown", "free");
    EXPECT_EQ(result_of(report, "known/unconstrained_diagonal")->verdict, Verdict::Passed);
    EXPECT_EQ(result_of(report, "known/free_diagonal")->detail, "minimal cannot solve \"free_diagonal\": it has rows.");
}

TEST(Conformance, FindsHandshakesThatFail) {
    const std::pair<const char*, const char*> cases[] = {
        {"wrong_abi", "built for version 99"},
        {"wrong_magic", "magic number"},
        {"small_descriptor", "24 bytes"},
        {"bad_name", "is not a word"},
        {"missing_operation", "lacks the operation factorize"},
        {"missing_symbol", "does not export delassus_plugin"},
        {"null_descriptor", "returned nothing"},
        {"throws_at_handshake", "thrown at the handshake"},
        {"duplicate_option", "option table"},
        {"default_outside_range", "cannot be \"3\""},
        {"crashes_at_load", "crashed: segmentation fault"},
        {"no_such_plugin", "there is no plugin"},
    };
    for (const auto& [name, words] : cases) {
        SCOPED_TRACE(name);
        const auto report = run_conformance(test::fixture(name));
        expect_failure(report, "handshake", words);
        EXPECT_TRUE(report.plugin.empty());
        EXPECT_EQ(report.results.size(), 2u);
    }
}

TEST(Conformance, FindsExceptions) {
    const auto create = run_conformance(test::fixture("throws_in_create"));
    expect_failure(create, "known/free_diagonal", "thrown in create");
    const auto solve = run_conformance(test::fixture("throws_in_solve"));
    expect_failure(solve, "known/free_diagonal", "thrown in solve");
    const auto number = run_conformance(test::fixture("throws_a_number"));
    expect_failure(number, "known/free_diagonal", "exception through the plugin border");
}

TEST(Conformance, FindsWrongAnswers) {
    const auto nan = run_conformance(test::fixture("returns_nan"));
    expect_failure(nan, "known/free_diagonal", "not finite");
    const auto claims = run_conformance(test::fixture("claims_falsely"));
    expect_failure(claims, "known/free_diagonal", "claimed convergence");
    expect_failure(claims, "claims/tolerances", "false_claim");
    expect_failure(claims, "failure/inconsistent", "says that \"inconsistent\" is solved");
    const auto status = run_conformance(test::fixture("unknown_status"));
    expect_failure(status, "progress/iterates", "1234");
    const auto fails = run_conformance(test::fixture("fails_to_factorize"));
    expect_failure(fails, "known/free_diagonal", "the pivot vanished");
}

TEST(Conformance, FindsCrashesAndEnds) {
    const auto crash = run_conformance(test::fixture("crashes_in_solve"));
    expect_failure(crash, "known/free_diagonal", "crashed: segmentation fault");
    EXPECT_EQ(result_of(crash, "identity/descriptor")->verdict, Verdict::Passed);
    const auto ends = run_conformance(test::fixture("exits"));
    expect_failure(ends, "known/free_diagonal", "ended the process with exit code 7");
    const auto at_exit = run_conformance(test::fixture("crashes_at_exit"));
    expect_only_failure(at_exit, "instances/end_of_process", "crashed while the process ended");
}

TEST(Conformance, FindsHangsAndDoesNotWaitForAll) {
    const auto begin = std::chrono::steady_clock::now();
    const auto hangs = run_conformance(test::fixture("hangs"), 1.0);
    expect_failure(hangs, "options/defaults", "did not return within 1 s");
    EXPECT_EQ(result_of(hangs, "known/mixed_definite")->verdict, Verdict::Skipped);
    EXPECT_EQ(hangs.count(Verdict::Failed), 3u) << failures_of(hangs);
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(60));
}

TEST(Conformance, FindsDeafness) {
    const auto report = run_conformance(test::fixture("ignores_progress"));
    expect_failure(report, "progress/cancel", "cancelled at call 1 of progress, it ended with");
    expect_failure(report, "progress/time_limit", "told that its time is over, it ended with");
    EXPECT_EQ(report.count(Verdict::Failed), 2u) << failures_of(report);
}

TEST(Conformance, FindsTheOneRuleThatIsBroken) {
    expect_only_failure(run_conformance(test::fixture("prints")), "output/quiet", "standard output");
    const auto analyzes = run_conformance(test::fixture("analyzes_always"));
    expect_failure(analyzes, "reuse/right_hand_sides", "new analysis");
    expect_failure(analyzes, "reuse/values", "new analysis");
    EXPECT_EQ(analyzes.count(Verdict::Failed), 2u) << failures_of(analyzes);
    expect_only_failure(run_conformance(test::fixture("remembers")), "instances/memory", "for the second time");
    expect_failure(run_conformance(test::fixture("divides_by_zero")), "known/apex_friction_reduced", "not finite");
    expect_failure(run_conformance(test::fixture("shares_state")), "instances/interleaved", "false_claim");
    expect_failure(run_conformance(test::fixture("writes_beyond")), "progress/iterates", "beyond the ends of λ");
    EXPECT_TRUE(run_conformance(test::fixture("newer_minor")).passed());
}

TEST(Conformance, WarnsOfAPluginBuiltWithoutOptimisation) {
    const auto report = run_conformance(test::fixture("unoptimized"));
    EXPECT_TRUE(report.passed()) << failures_of(report);
    EXPECT_EQ(report.count(Verdict::Warning), 1u);
    ASSERT_NE(result_of(report, "identity/build"), nullptr);
    EXPECT_EQ(result_of(report, "identity/build")->verdict, Verdict::Warning);
    EXPECT_EQ(nlohmann::json::parse(to_json(report)).at("passed"), true);
    EXPECT_NE(to_json(report).find("\"warning\""), std::string::npos);
    const auto silent = run_conformance(test::fixture("minimal"));
    EXPECT_EQ(result_of(silent, "identity/build")->verdict, Verdict::Skipped);
    EXPECT_NE(result_of(silent, "identity/build")->detail.find("DELASSUS_BUILD"), std::string::npos);
}

TEST(Conformance, FindsLeaks) {
#if defined(__SANITIZE_ADDRESS__)
    GTEST_SKIP() << "the sanitizer looks for leaks itself";
#endif
    expect_only_failure(run_conformance(test::fixture("leaks")), "instances/leaks", "memory grows by 14");
}

TEST(Conformance, ReportIsJson) {
    const auto report = run_conformance(test::fixture("minimal"));
    const auto json = nlohmann::json::parse(to_json(report));
    EXPECT_EQ(json.at("plugin"), "minimal");
    EXPECT_EQ(json.at("passed"), false);
    EXPECT_EQ(json.at("checks").size(), report.results.size());
    EXPECT_EQ(json.at("checks").at(0).at("name"), "handshake");
    EXPECT_EQ(json.at("checks").at(0).at("verdict"), "passed");
}

}  // namespace
}  // namespace delassus::check::conformance_test
