// SPDX-License-Identifier: BSD-3-Clause
// Ctrl-C while a solver works: the solve ends with what was reached.
#include <csignal>

#include "bench_fixture.hpp"
#include "support/places.hpp"
#include "support/run_command.hpp"

namespace delassus::bench_test::interrupt_test {
namespace {

class Interrupt : public BenchTest {
protected:
    /// Starts `delassus solve` on the tiny problem with these further arguments, and goes on with the shell's lines
    /// once the solver is at work ($! is the command's process). A command that ended before does not keep the test
    /// waiting.
    [[nodiscard]] tests::CommandResult solve_then(const std::string& arguments, const std::string& lines) const {
        return tests::run_shell(std::string(tests::places::command) + " solve " + (folder / "stops").string() +
                                " --solver " + std::string(tests::places::plugins) + "/misbehaving.so " + arguments +
                                " & until [ -e " + at_work().string() + " ] || ! kill -0 $!; do sleep 0.02; done; " +
                                lines + "; wait $!");
    }
};

TEST_F(Interrupt, EndsASolveWithWhatWasReached) {
    const auto result = solve_then("--set behaviour=slow --json --solution " + (folder / "solution").string(),  //
                                   "kill -INT $!");
    EXPECT_NE(result.out.find("\"status\": \"cancelled\""), std::string::npos) << result.out << result.err;
    EXPECT_TRUE(fs::exists(folder / "solution" / "lambda.mtx"));
}

TEST_F(Interrupt, OneRequestMayArriveAsTwoSignals) {
    const auto result = solve_then("--set behaviour=slow --json", "kill -INT $!; sleep 0.1; kill -INT $!");
    EXPECT_NE(result.out.find("\"status\": \"cancelled\""), std::string::npos) << result.out << result.err;
}

TEST_F(Interrupt, AnInsistentOneEndsASolverThatNeverLooks) {
    const auto result = solve_then("--set behaviour=hang", "kill -INT $!; sleep 1; kill -INT $!");
    EXPECT_EQ(result.exit_code, 128 + SIGINT) << result.out << result.err;
}

}  // namespace
}  // namespace delassus::bench_test::interrupt_test
