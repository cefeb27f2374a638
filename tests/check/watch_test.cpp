// SPDX-License-Identifier: BSD-3-Clause
// What a plugin does to its process becomes a sentence that names it and its operation, and an exit code.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "delassus/problem_files.hpp"
#include "helpers.hpp"
#include "support/places.hpp"

namespace delassus::watch_test {
namespace {

using test::fixture;
using test::run_command;

class Watch : public testing::Test {
protected:
    void SetUp() override {
        write_problem(test::known_problem("friction_diagonal_associated").problem, problem());
        write_scene("");
    }
    [[nodiscard]] std::filesystem::path problem() const { return folder_.path() / "problem"; }
    [[nodiscard]] std::filesystem::path scene() const { return folder_.path() / "scene.yaml"; }

    /// A ball on the ground, with more keys of its solver.
    void write_scene(const std::string& keys) const {
        std::ofstream(scene()) << "step: 0.01\nend: 0.05\nmaterials: {m: {friction: 0.5}}\nsolver: {name: "
                               << fixture("misbehaves").string() << keys << "}\nbodies:\n"
                               << "  - {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
                               << "  - {name: ball, density: 1000, position: [0, 0, 0.1], velocity: [1, 0, 0], shapes: "
                                  "[{sphere: {radius: 0.1}, material: m}]}\n";
    }

    test::CommandResult with(const std::string& deed, const std::vector<std::string>& arguments) const {
        return run_command(arguments, {{"DELASSUS_TEST_DEED", deed}});
    }
    test::CommandResult solve(const std::string& deed, const std::vector<std::string>& more = {}) const {
        std::vector<std::string> arguments{"solve", problem().string(), "--solver", fixture("misbehaves").string()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return with(deed, arguments);
    }

    test::TemporaryFolder folder_;
};

TEST_F(Watch, WhoeverEndsTheProcessIsNamed) {
    const std::pair<const char*, const char*> deeds[] = {{"exit", "ended the process by itself, with exit code 0"},
                                                         {"_exit", "ended the process by itself, with exit code 0"},
                                                         {"exit7", "ended the process by itself, with exit code 7"},
                                                         {"abort", "crashed: an abort"},
                                                         {"fault", "crashed: a segmentation fault"},
                                                         {"alarm", "was ended by SIGALRM"}};
    for (const char* operation : {"load", "create", "analyze", "factorize", "solve", "destroy"})
        for (const auto& [deed, words] : deeds) {
            const std::string what = std::string(operation) + " " + deed;
            for (const auto& result : {solve(what), with(what, {"run", scene().string()})}) {
                EXPECT_EQ(result.exit_code, 3) << what << result.err << result.out;
                EXPECT_NE(result.err.find(words), std::string::npos) << what << ": " << result.err;
                EXPECT_NE(result.err.find("misbehaves"), std::string::npos) << what << ": " << result.err;
                const std::string place =
                    std::string(operation) == "load" ? "while it was loaded" : "in " + std::string(operation);
                EXPECT_NE(result.err.find(place), std::string::npos) << what << ": " << result.err;
            }
        }
}

TEST_F(Watch, CommandsThatOnlyLookAreWatchedToo) {
    for (const char* deed : {"load exit", "load fault"})
        for (const auto& arguments : {std::vector<std::string>{"plan", scene().string()},
                                      {"plugins", "info", fixture("misbehaves").string()}}) {
            const auto result = with(deed, arguments);
            if (arguments[0] == "plan" && result.exit_code == 0) continue;  // it loaded nothing
            EXPECT_EQ(result.exit_code, 3) << arguments[0] << ": " << result.out << result.err;
            EXPECT_NE(result.err.find("misbehaves"), std::string::npos) << arguments[0] << ": " << result.err;
        }
}

TEST_F(Watch, AKilledProcessIsASentence) {
    const auto result = solve("solve kill");
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_NE(result.err.find("was ended by SIGKILL"), std::string::npos) << result.err;
}

TEST_F(Watch, WhoeverDoesNotAnswerIsEndedByTheTimeLimit) {
    write_scene(", time_limit: 0.1");
    for (const char* operation : {"analyze", "factorize", "solve"})
        for (const char* deed : {"hang", "deaf", "stop"}) {
            const std::string what = std::string(operation) + " " + deed;
            for (const auto& result : {solve(what, {"--time-limit", "0.1"}), with(what, {"run", scene().string()})}) {
                EXPECT_EQ(result.exit_code, 3) << what;
                EXPECT_NE(result.err.find("misbehaves did not answer for 2.1 s, in " + std::string(operation)),
                          std::string::npos)
                    << what << ": " << result.err;
            }
        }
}

TEST_F(Watch, WhatHappensAfterTheAnswerLeavesItsExitCode) {
    for (const char* deed : {"unload exit7", "unload fault", "unload abort", "unload kill"}) {
        const auto result = solve(deed);
        EXPECT_EQ(result.exit_code, std::string(deed) == "unload exit7" ? 7 : 0) << deed << result.err;
        EXPECT_NE(result.out.find("solved"), std::string::npos) << deed;
    }
}

TEST_F(Watch, ACopyOfTheProcessSaysNothing) {
    const auto result = solve("solve fork");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const auto first = result.out.find("with misbehaves");
    EXPECT_NE(first, std::string::npos) << result.out;
    EXPECT_EQ(result.out.find("with misbehaves", first + 1), std::string::npos) << result.out;
}

TEST_F(Watch, ClosedDescriptorsDoNotHideTheAnswer) {
    const auto result = solve("solve close");
    EXPECT_TRUE(result.exit_code == 0 ? !result.out.empty() : !result.err.empty()) << result.exit_code;
}

TEST_F(Watch, LongTimeLimitsAreNoLimit) {
    for (const char* limit : {"5e9", "1e300", "inf"}) {
        const auto result = solve("", {"--time-limit", limit});
        EXPECT_EQ(result.exit_code, 0) << limit << ": " << result.err;
    }
    for (const char* limit : {"nan", "-1", "0", "-inf"}) {
        const auto result = solve("", {"--time-limit", limit});
        EXPECT_EQ(result.exit_code, 2) << limit << ": " << result.out;
        EXPECT_NE(result.err.find("time limit"), std::string::npos) << limit << ": " << result.err;
    }
    for (const char* keys : {", time_limit: -1", ", time_limit: .nan", ", tolerance: 0", ", max_iterations: -1"}) {
        write_scene(keys);
        const auto result = with("", {"run", scene().string()});
        EXPECT_EQ(result.exit_code, 2) << keys << result.out;
        EXPECT_NE(result.err.find("scene.yaml"), std::string::npos) << keys << ": " << result.err;
    }
}

// One Ctrl-C for who does not hear it, then another.
TEST_F(Watch, TwoInterruptsEndWhatIsDeaf) {
    const pid_t command = fork();
    ASSERT_GE(command, 0);
    if (command == 0) {
        setenv("DELASSUS_TEST_DEED", "solve deaf", 1);
        execl(tests::places::command, "delassus", "solve", problem().c_str(), "--solver", fixture("misbehaves").c_str(),
              static_cast<char*>(nullptr));
        _exit(127);
    }
    std::this_thread::sleep_for(std::chrono::seconds(2));
    kill(command, SIGINT);
    std::this_thread::sleep_for(std::chrono::seconds(1));
    kill(command, SIGINT);
    int status = 0;
    ASSERT_EQ(waitpid(command, &status, 0), command);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGINT) << status;
}

}  // namespace
}  // namespace delassus::watch_test
