// SPDX-License-Identifier: BSD-3-Clause
// `mpirun -n 3 delassus solve` in parts, and what happens to the others when one process fails.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>
#include <thread>
#include <tuple>

#include "delassus/distributed.hpp"
#include "delassus/problem_files.hpp"
#include "support/places.hpp"
#include "support/run_command.hpp"

#ifdef DELASSUS_HAS_MPI

namespace delassus::tests::parts_command_test {
namespace {

class PartsCommand : public testing::Test {
protected:
    void SetUp() override {
        if (process_count() > 1) GTEST_SKIP() << "it starts mpirun itself";
        ASSERT_EQ(run_command("generate box_stack " + problem()).exit_code, 0);
    }
    [[nodiscard]] std::string problem() const { return (folder / "stack").string(); }
    [[nodiscard]] static CommandResult mpirun(int processes, const std::string& arguments,
                                              const std::string& environment = "") {
        // Without what a solver with MPI in this process has left in the environment: mpirun would not start under it.
        return run_shell("env -i PATH=\"$PATH\" HOME=\"$HOME\" " + environment +
                         " OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun -n " +
                         std::to_string(processes) + " --oversubscribe " + tests::places::command + " " + arguments +
                         " --plugin-path " + tests::places::plugins);
    }

    ScratchFolder folder;
};

TEST_F(PartsCommand, GivesTheSerialAnswer) {
    const std::string line = "solve " + problem() + " --solver parts_gradient --tolerance 1e-10 --json --solution ";
    const auto serial = run_command(line + (folder / "one").string() + " --plugin-path " + tests::places::plugins);
    ASSERT_EQ(serial.exit_code, 0) << serial.err;
    const auto parts = mpirun(3, line + (folder / "three").string());
    ASSERT_EQ(parts.exit_code, 0) << parts.err;
    const auto report = nlohmann::json::parse(parts.out);
    EXPECT_EQ(report["status"], "solved");
    ASSERT_EQ(report["processes"].size(), 3U);
    EXPECT_GT(report["processes"][1]["ghosts"], 0);
    const auto whole = read_problem(problem());
    const Solution one = read_solution(folder / "one", whole.n(), whole.m());
    const Solution three = read_solution(folder / "three", whole.n(), whole.m());
    for (std::size_t i = 0; i < one.x.size(); ++i) EXPECT_NEAR(one.x[i], three.x[i], 1e-10) << "m/s or rad/s";
    double loads = 0.0, difference = 0.0;
    for (std::size_t i = 0; i < one.lambda.size(); ++i) {
        loads = std::hypot(loads, one.lambda[i]);
        difference = std::hypot(difference, one.lambda[i] - three.lambda[i]);
    }
    EXPECT_GT(loads, 0.0);
    EXPECT_LE(difference, 1e-6 * loads);

    const auto again =
        mpirun(2, "solve " + problem() + " --solver parts_gradient --tolerance 1e-9 --json --warm-start " +
                      (folder / "three").string());
    ASSERT_EQ(again.exit_code, 0) << again.err;
    EXPECT_EQ(nlohmann::json::parse(again.out)["iterations"], 0);
}

TEST_F(PartsCommand, ReadsAndWritesOneFile) {
    const std::string file = (folder / "stack.h5").string();
    if (run_command("convert " + problem() + " " + file).exit_code != 0) GTEST_SKIP() << "no HDF5 in this build";
    const std::string line = "solve " + file + " --solver parts_gradient --json --tolerance ";
    const auto parts = mpirun(3, line + "1e-10 --solution " + (folder / "answer.h5").string());
    ASSERT_EQ(parts.exit_code, 0) << parts.err;
    EXPECT_EQ(nlohmann::json::parse(parts.out)["status"], "solved");
    ASSERT_TRUE(std::filesystem::is_regular_file(folder / "answer.h5"));
    for (const int processes : {1, 2}) {
        const auto again = mpirun(processes, line + "1.01e-10 --warm-start " + (folder / "answer.h5").string());
        ASSERT_EQ(again.exit_code, 0) << again.err;
        EXPECT_LE(nlohmann::json::parse(again.out)["iterations"], 1);
    }
}

TEST_F(PartsCommand, AFailureOfAllIsOneSentence) {
    using Case = std::tuple<std::string, std::string, int>;
    for (const auto& [line, sentence, exit_code] :
         {Case("solve nowhere --solver parts_gradient", "nowhere: there is no such file or folder.", 2),
          Case("solve " + problem() + " --solver pgs", "pgs cannot solve \"stack\": a distributed run. Can: ", 4)}) {
        const auto result = mpirun(3, line);
        EXPECT_EQ(result.exit_code, exit_code);
        const auto place = result.err.find("delassus: " + sentence);
        EXPECT_NE(place, std::string::npos) << result.err;
        EXPECT_EQ(result.err.find("delassus: ", place + 1), std::string::npos) << result.err;
    }
}

struct Fault {
    const char *name, *sentence;
};

class FaultyProcess : public PartsCommand, public testing::WithParamInterface<Fault> {};

TEST_P(FaultyProcess, EndsTheRunOfAll) {
    const auto start = std::chrono::steady_clock::now();
    const auto result = mpirun(3, "solve " + problem() + " --solver parts_gradient --set fault=" + GetParam().name +
                                      " --solution " + (folder / "answer").string());
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_NE(result.err.find(GetParam().sentence), std::string::npos) << result.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "answer"));
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
        EXPECT_EQ(entry.path().filename(), "stack") << "something half-written stays";
}

INSTANTIATE_TEST_SUITE_P(
    Faults, FaultyProcess,
    testing::Values(Fault{"throw",
                          "delassus: process 1 of 3 failed, so the others end too: parts_gradient: the disk of "
                          "this node is gone"},
                    Fault{"memory",
                          "delassus: process 1 of 3 failed, so the others end too: parts_gradient: out of "
                          "memory"},
                    Fault{"kill",
                          "delassus: process 1 of 3 was ended by SIGKILL (Killed), as when its node is out of "
                          "memory; so the others end too"},
                    Fault{"crash",
                          "delassus: process 1 of 3, with the solver parts_gradient, crashed: a segmentation "
                          "fault"}),
    [](const auto& of) { return std::string(of.param.name); });

// kill -9 from outside: all are gone within five seconds of it.
TEST_F(PartsCommand, AKilledProcessEndsTheOthersWithinFiveSeconds) {
    const auto at_work = folder / "at_work";
    auto result = std::async(std::launch::async, [&] {
        return mpirun(3, "solve " + problem() + " --solver parts_gradient --set fault=wait",
                      "DELASSUS_TEST_AT_WORK=" + at_work.string());
    });
    pid_t process = 0;
    for (int tries = 0; process == 0 && tries < 200; ++tries) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        std::string line;
        std::ifstream stream(at_work);
        if (std::getline(stream, line) && !stream.eof()) process = static_cast<pid_t>(std::stol(line));
    }
    ASSERT_GT(process, 0) << "the plugin never waited";
    const auto start = std::chrono::steady_clock::now();
    ASSERT_EQ(kill(process, SIGKILL), 0);
    const CommandResult ended = result.get();
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
    EXPECT_EQ(ended.exit_code, 3);
    EXPECT_NE(ended.err.find("process 1 of 3 was ended by SIGKILL"), std::string::npos) << ended.err;
}

}  // namespace
}  // namespace delassus::tests::parts_command_test

#endif
