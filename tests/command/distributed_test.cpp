// SPDX-License-Identifier: BSD-3-Clause
// `mpirun -n 2 delassus solve` gives the serial answer.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "delassus/problem_files.hpp"
#include "support/places.hpp"
#include "support/run_command.hpp"

namespace delassus::tests::distributed_test {
namespace {

class DistributedCommand : public testing::TestWithParam<const char*> {};

TEST_P(DistributedCommand, GivesTheSerialAnswer) {
    const std::string solver = GetParam();
    if (run_shell("mpirun --version").exit_code != 0) GTEST_SKIP() << "mpirun is not installed";
    if (run_command("plugins info " + solver).exit_code != 0) GTEST_SKIP() << solver << " is not built";
    const ScratchFolder folder;
    const std::string problem = (folder / "chain").string();
    ASSERT_EQ(run_command("generate chain " + problem + " --set bodies=300 --set mass_ratio=1e6").exit_code, 0);
    const std::string line = " solve " + problem + " --solver " + solver + " --tolerance 1e-10 --json --solution ";
    const auto serial = run_command(line + (folder / "serial").string());
    ASSERT_EQ(serial.exit_code, 0) << serial.err;
    const auto both =
        run_shell("OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun -n 2 --oversubscribe " +
                  std::string(tests::places::command) + line + (folder / "both").string());
    ASSERT_EQ(both.exit_code, 0) << both.err;
    EXPECT_EQ(nlohmann::json::parse(both.out)["status"], "solved") << "one report, by the first process";

    const auto chain = read_problem(problem);
    const Solution one = read_solution(folder / "serial", chain.n(), chain.m());
    const Solution two = read_solution(folder / "both", chain.n(), chain.m());
    double difference = 0.0, size = 0.0;
    for (std::size_t i = 0; i < one.x.size(); ++i) {
        difference = std::hypot(difference, one.x[i] - two.x[i]);
        size = std::hypot(size, one.x[i]);
    }
    EXPECT_LE(difference, 1e-8 * size);
}

// A process of its own makes no folder where others of its user make and remove theirs, and leaves nothing.
TEST_P(DistributedCommand, AloneNeedsNoSessionFolder) {
    const std::string solver = GetParam();
    if (run_command("plugins info " + solver).exit_code != 0) GTEST_SKIP() << solver << " is not built";
    const ScratchFolder folder;
    const std::string problem = (folder / "chain").string(), temporary = (folder / "tmp").string();
    ASSERT_EQ(run_command("generate chain " + problem + " --set bodies=5").exit_code, 0);
    const std::string line = std::string(tests::places::command) + " solve " + problem + " --solver " + solver;
    const auto nowhere = run_shell("TMPDIR=/dev/null/none " + line);
    EXPECT_EQ(nowhere.exit_code, 0) << nowhere.err;
    std::filesystem::create_directory(temporary);
    const auto somewhere = run_shell("TMPDIR=" + temporary + " " + line);
    EXPECT_EQ(somewhere.exit_code, 0) << somewhere.err;
    EXPECT_TRUE(std::filesystem::is_empty(temporary));
}

TEST_P(DistributedCommand, ManyStartAtOnce) {
    const std::string solver = GetParam();
    if (run_command("plugins info " + solver).exit_code != 0) GTEST_SKIP() << solver << " is not built";
    const ScratchFolder folder;
    const std::string problem = (folder / "chain").string();
    ASSERT_EQ(run_command("generate chain " + problem + " --set bodies=5").exit_code, 0);
    const auto all =
        run_shell("for round in 1 2 3 4 5; do for process in 1 2 3 4 5 6; do " + std::string(tests::places::command) +
                  " solve " + problem + " --solver " + solver + " >/dev/null || echo failed & done; wait; done");
    EXPECT_EQ(all.out, "") << all.err;
}

INSTANTIATE_TEST_SUITE_P(Solvers, DistributedCommand, testing::Values("petsc", "mumps"),
                         [](const auto& parameter) { return std::string(parameter.param); });

}  // namespace
}  // namespace delassus::tests::distributed_test
