// SPDX-License-Identifier: BSD-3-Clause
// Ctrl-C while a solver works: the solve ends with what was reached.
#include <csignal>

#include "bench_fixture.hpp"
#include "support/run_command.hpp"

namespace delassus::bench_test::interrupt_test {
namespace {

TEST_F(BenchTest, InterruptEndsASolveWithWhatWasReached) {
    // A solver that never ends by itself; the signal comes long after the tiny problem was read, on a busy machine too.
    const auto result =
        tests::run_shell("timeout -s INT 5 " DELASSUS_COMMAND " solve " + (folder / "stops").string() +
                         " --solver " DELASSUS_TEST_PLUGINS "/misbehaving.so --set behaviour=slow --json --solution " +
                         (folder / "solution").string());
    EXPECT_NE(result.out.find("\"status\": \"cancelled\""), std::string::npos) << result.out << result.err;
    EXPECT_TRUE(fs::exists(folder / "solution" / "lambda.mtx"));
}

TEST_F(BenchTest, OneRequestMayArriveAsTwoSignals) {
    const auto result = tests::run_shell(
        DELASSUS_COMMAND " solve " + (folder / "stops").string() +
        " --solver " DELASSUS_TEST_PLUGINS
        "/misbehaving.so --set behaviour=slow --json & sleep 4; kill -INT $!; sleep 0.1; kill -INT $!; wait $!");
    EXPECT_NE(result.out.find("\"status\": \"cancelled\""), std::string::npos) << result.out << result.err;
}

TEST_F(BenchTest, AnInsistentInterruptEndsASolverThatNeverLooks) {
    const auto result = tests::run_shell(
        DELASSUS_COMMAND " solve " + (folder / "stops").string() +
        " --solver " DELASSUS_TEST_PLUGINS
        "/misbehaving.so --set behaviour=hang & sleep 4; kill -INT $!; sleep 1; kill -INT $!; wait $!");
    EXPECT_EQ(result.exit_code, 128 + SIGINT) << result.out << result.err;
}

}  // namespace
}  // namespace delassus::bench_test::interrupt_test
