// SPDX-License-Identifier: BSD-3-Clause
// A check in a process of its own: whatever it does, the caller goes on.
#include "check/isolated.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>

namespace delassus::check::isolated_test {
namespace {

using Verdict = CheckResult::Verdict;

IsolatedOutcome run(const std::function<std::string()>& body, double seconds = 10.0) {
    return run_isolated(seconds, Leave::AtOnce, body);
}

TEST(Isolated, ReturnsTheDetail) {
    const auto outcome = run([] { return std::string("42 figures"); });
    EXPECT_EQ(outcome.verdict, Verdict::Passed);
    EXPECT_EQ(outcome.detail, "42 figures");
    EXPECT_EQ(outcome.bytes_printed, 0u);
}

TEST(Isolated, ReturnsMoreThanAPipeHolds) {
    const auto outcome = run([] { return std::string(1000000, 'x'); });
    EXPECT_EQ(outcome.verdict, Verdict::Passed);
    EXPECT_EQ(outcome.detail.size(), 1000000u);
}

TEST(Isolated, KnowsFailureAndSkip) {
    const auto failed = run([]() -> std::string { throw Failure("the reason"); });
    EXPECT_EQ(failed.verdict, Verdict::Failed);
    EXPECT_EQ(failed.detail, "the reason");
    const auto skipped = run([]() -> std::string { throw Skip("another reason"); });
    EXPECT_EQ(skipped.verdict, Verdict::Skipped);
    EXPECT_EQ(skipped.detail, "another reason");
    const auto warning = run([]() -> std::string { throw Warning("a third reason"); });
    EXPECT_EQ(warning.verdict, Verdict::Warning);
    EXPECT_EQ(warning.detail, "a third reason");
    const auto number = run([]() -> std::string { throw 42; });
    EXPECT_EQ(number.verdict, Verdict::Failed);
    EXPECT_NE(number.detail.find("exception"), std::string::npos);
}

TEST(Isolated, OutlivesCrashes) {
    const auto outcome = run([]() -> std::string {
        std::raise(SIGSEGV);
        return {};
    });
    EXPECT_EQ(outcome.verdict, Verdict::Failed);
    EXPECT_EQ(outcome.detail, "crashed: segmentation fault");
}

TEST(Isolated, OutlivesExits) {
    const auto outcome = run([]() -> std::string { _exit(0); });
    EXPECT_EQ(outcome.verdict, Verdict::Failed);
    EXPECT_EQ(outcome.detail, "ended the process with exit code 0");
}

TEST(Isolated, EndsHangs) {
    const auto begin = std::chrono::steady_clock::now();
    const auto outcome = run(
        []() -> std::string {
            for (;;) pause();
        },
        0.5);
    EXPECT_EQ(outcome.verdict, Verdict::Failed);
    EXPECT_FALSE(outcome.returned);
    EXPECT_EQ(outcome.detail, "did not return within 0.5 s");
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

TEST(Isolated, CountsWhatIsPrinted) {
    const auto outcome = run([] {
        std::printf("twelve bytes");
        return std::string();
    });
    EXPECT_EQ(outcome.verdict, Verdict::Passed);
    EXPECT_EQ(outcome.bytes_printed, 12u);
}

}  // namespace
}  // namespace delassus::check::isolated_test
