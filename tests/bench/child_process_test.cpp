// SPDX-License-Identifier: BSD-3-Clause
#include "process/child_process.hpp"

#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "delassus/error.hpp"

namespace delassus::child_process_test {
namespace {

ChildSettings shell(const std::string& script, double timeout = 60.0) {
    ChildSettings settings;
    settings.program = "/bin/sh";
    settings.arguments = {"-c", script};
    settings.timeout = timeout;
    return settings;
}

TEST(ChildProcess, ReportsExitCodeOutputAndErrors) {
    const auto result = run_child(shell("echo out; echo err >&2; exit 5"));
    EXPECT_EQ(result.exit_code, 5);
    EXPECT_EQ(result.signal, 0);
    EXPECT_EQ(result.output, "out\n");
    EXPECT_EQ(result.errors, "err\n");
    EXPECT_GT(result.peak_memory, 100'000);
}

TEST(ChildProcess, PassesInputAndEnvironment) {
    auto settings = shell("cat; printf %s \"$DELASSUS_WORD\"");
    settings.input = std::string(300'000, 'x');
    settings.environment = {{"DELASSUS_WORD", "yes"}};
    EXPECT_EQ(run_child(settings).output, settings.input + "yes");
}

TEST(ChildProcess, TakesMuchOnBothEndsWithoutDeadlock) {
    const auto result =
        run_child(shell("head -c 2000000 /dev/zero >&2; head -c 3000000 /dev/zero; head -c 2000000 /dev/zero >&2"));
    EXPECT_EQ(result.output.size(), 3'000'000U);
    EXPECT_GE(result.errors.size(), 64U * 1024U);
    EXPECT_LE(result.errors.size(), 160U * 1024U);
}

TEST(ChildProcess, ReportsTheSignal) {
    const auto result = run_child(shell("kill -SEGV $$"));
    EXPECT_FALSE(result.exit_code);
    EXPECT_EQ(result.signal, SIGSEGV);
    EXPECT_EQ(signal_name(result.signal), "SIGSEGV (Segmentation fault)");
}

TEST(ChildProcess, KillsTheWholeGroupAfterItsTime) {
    // The grandchild holds our pipe; it must be gone too, or we would wait for it.
    const auto result = run_child(shell("trap '' INT TERM; sleep 100 & echo $!; sleep 100", 0.3));
    EXPECT_TRUE(result.timed_out);
    EXPECT_EQ(result.signal, SIGKILL);
    EXPECT_LT(result.seconds, 5.0);
    const int grandchild = std::stoi(result.output);
    for (int tries = 0; tries < 100 && kill(grandchild, 0) == 0; ++tries)
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    std::error_code error;
    // Where nobody reaps orphans, a zombie is left of it.
    if (kill(grandchild, 0) == 0) {
        FILE* file = std::fopen(("/proc/" + std::to_string(grandchild) + "/stat").c_str(), "r");
        char state = 'Z';
        if (file) {
            ASSERT_EQ(std::fscanf(file, "%*d %*s %c", &state), 1);
            std::fclose(file);
        }
        EXPECT_EQ(state, 'Z');
    }
}

TEST(ChildProcess, ALeftOverGrandchildDoesNotHoldUs) {
    const auto result = run_child(shell("sleep 100 & echo done"));
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.output, "done\n");
    EXPECT_LT(result.seconds, 5.0);
}

TEST(ChildProcess, OutputRenewsTheTime) {
    auto settings = shell("for i in 1 2 3 4 5 6; do echo $i; sleep 0.2; done", 0.8);
    settings.on_output = [](std::string_view) { return 0.8; };
    EXPECT_FALSE(run_child(settings).timed_out);
    settings.on_output = [](std::string_view) { return 0.05; };
    EXPECT_TRUE(run_child(settings).timed_out);
}

TEST(ChildProcess, EndlessOutputDoesNotOutliveTheTime) {
    auto settings = shell("yes", 0.3);
    settings.on_output = [](std::string_view) { return 0.0; };
    EXPECT_TRUE(run_child(settings).timed_out);
    const auto result = run_child(shell("yes >&2", 0.3));
    EXPECT_TRUE(result.timed_out);
    EXPECT_LT(result.seconds, 5.0);
}

TEST(ChildProcess, CancelAsksFirstAndKillsThen) {
    auto polite = shell("trap 'echo bye; exit 3' INT; while :; do sleep 0.05; done");
    bool now = false;
    polite.on_output = {};
    const auto begin = std::chrono::steady_clock::now();
    polite.cancelled = [&] { return std::chrono::steady_clock::now() - begin > std::chrono::milliseconds(300); };
    auto result = run_child(polite);
    EXPECT_TRUE(result.cancelled);
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_EQ(result.output, "bye\n");

    auto stubborn = shell("trap '' INT; while :; do sleep 0.05; done");
    stubborn.cancelled = [&] { return now = true; };
    stubborn.cancel_grace = 0.2;
    result = run_child(stubborn);
    EXPECT_TRUE(now);
    EXPECT_TRUE(result.cancelled);
    EXPECT_FALSE(result.timed_out);
    EXPECT_EQ(result.signal, SIGKILL);
}

TEST(ChildProcess, LimitsMemory) {
    auto settings = shell("ulimit -v");
    settings.memory_limit = 512ULL << 20;
    EXPECT_EQ(run_child(settings).output, "524288\n");
}

TEST(ChildProcess, PinsToOneCore) {
    const auto cores = allowed_cores();
    ASSERT_FALSE(cores.empty());
    auto settings = shell("nproc");
    settings.core = cores.back();
    EXPECT_EQ(run_child(settings).output, "1\n");
}

TEST(ChildProcess, SaysThatAProgramIsNotThere) {
    ChildSettings settings;
    settings.program = "/nowhere/at-all";
    try {
        static_cast<void>(run_child(settings));
        FAIL();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("/nowhere/at-all cannot be started: No such file"), std::string::npos);
    }
}

}  // namespace
}  // namespace delassus::child_process_test
