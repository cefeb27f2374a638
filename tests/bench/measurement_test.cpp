// SPDX-License-Identifier: BSD-3-Clause
// Whatever a solver does in its process, it is a row.
#include <chrono>

#include "bench_fixture.hpp"
#include "delassus/error.hpp"

namespace delassus::bench_test::measurement_test {
namespace {

using ::testing::Test;

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

TEST_F(BenchTest, ASolverThatSolves) {
    const auto row = measure("solve");
    EXPECT_EQ(row.status, "solved") << row.message;
    EXPECT_EQ(row.message, "");
    EXPECT_EQ(row.label, "misbehaving(behaviour=solve)");
    EXPECT_EQ(row.solver, "misbehaving");
    EXPECT_EQ(row.version, "1.0.0");
    EXPECT_EQ(row.iterations, 60);
    ASSERT_TRUE(row.error);
    EXPECT_LT(row.error->natural, 1e-12);
    ASSERT_EQ(row.repeats.size(), 3U);
    for (const auto& repeat : row.repeats) EXPECT_LE(row.solve, repeat.solve);
    EXPECT_GT(row.solve, 0.0);
    EXPECT_GT(row.peak_memory, 1'000'000);
    ASSERT_GE(row.curve.size(), 2U);
    EXPECT_GT(row.curve.front().natural, 0.1);
    EXPECT_EQ(row.curve.back().natural, row.error->natural);
    for (std::size_t k = 1; k < row.curve.size(); ++k) EXPECT_GE(row.curve[k].seconds, row.curve[k - 1].seconds);
}

TEST_F(BenchTest, ACrash) {
    const auto row = measure("crash");
    EXPECT_EQ(row.status, "crashed");
    EXPECT_FALSE(row.error);
    EXPECT_FALSE(row.iterations);
    EXPECT_TRUE(contains(row.message, "before its first iterate")) << row.message;
}

TEST_F(BenchTest, ACrashKeepsTheCurve) {
    const auto row = measure("crash_late");
    EXPECT_EQ(row.status, "crashed");
    EXPECT_FALSE(row.curve.empty());
    EXPECT_TRUE(contains(row.message, "after iteration")) << row.message;
}

TEST_F(BenchTest, AnExitIsACrash) {
    const auto row = measure("exit");
    EXPECT_EQ(row.status, "crashed");
    EXPECT_TRUE(contains(row.message, "exit code 7")) << row.message;
}

TEST_F(BenchTest, AHangIsKilledAndKeepsTheCurve) {
    for (const char* behaviour : {"hang", "deaf"}) {  // silent, or talking on after it was told to stop
        const auto row = measure(behaviour, 0.3);
        EXPECT_EQ(row.status, "hung") << behaviour << ": " << row.message;
        EXPECT_FALSE(row.error);
        EXPECT_FALSE(row.curve.empty());
    }
}

TEST_F(BenchTest, TheTimeLimitIsAStatus) {
    const auto row = measure("slow", 0.3);
    EXPECT_EQ(row.status, "time_limit") << row.message;
    ASSERT_TRUE(row.error);
    EXPECT_GE(row.solve, 0.29);
    EXPECT_LT(row.solve, 2.0);
    EXPECT_TRUE(row.repeats.empty());
}

TEST_F(BenchTest, AFalseClaim) {
    const auto row = measure("lie");
    EXPECT_EQ(row.status, "false_claim");
    ASSERT_TRUE(row.error);
    EXPECT_GT(row.error->natural, 0.1);
}

TEST_F(BenchTest, AnUnprovenImpossibilityIsAFalseClaim) {
    const auto row = measure("despair");
    EXPECT_EQ(row.status, "false_claim");
    EXPECT_TRUE(contains(row.message, "claimed that there is no solution")) << row.message;
}

TEST_F(BenchTest, NotANumber) {
    const auto row = measure("nan");
    EXPECT_EQ(row.status, "numerical_failure");
    EXPECT_TRUE(contains(row.message, "not finite")) << row.message;
}

TEST_F(BenchTest, AnException) {
    const auto row = measure("throw");
    EXPECT_EQ(row.status, "error");
    EXPECT_TRUE(contains(row.message, "on fire")) << row.message;
}

TEST_F(BenchTest, PrintingIsKeptApartAndSaid) {
    const auto row = measure("print");
    EXPECT_EQ(row.status, "solved");
    EXPECT_TRUE(contains(row.message, "to standard output")) << row.message;
}

TEST_F(BenchTest, ARefusalIsItsSentence) {
    const auto row = measure("solve", 20.0, "friction");
    EXPECT_EQ(row.status, "unsupported");
    EXPECT_TRUE(contains(row.message, "misbehaving cannot solve \"friction\": 1 friction cone")) << row.message;
    EXPECT_FALSE(row.error);
}

TEST_F(BenchTest, AnInterruptKeepsWhatWasReached) {
    auto settings = worker();
    settings.cancelled = [&] { return fs::exists(at_work()); };
    bench::MeasureRequest request;
    request.problem = folder / "stops";
    request.solver.name = "misbehaving";
    request.solver.options = {{"behaviour", "slow"}};
    const auto row = bench::measure(settings, request);
    EXPECT_EQ(row.status, "cancelled") << row.message;
    EXPECT_TRUE(row.error);
    EXPECT_FALSE(row.curve.empty());
}

TEST_F(BenchTest, TooLittleMemoryIsARow) {
#if defined(__SANITIZE_ADDRESS__)
    GTEST_SKIP() << "the address sanitizer needs more address space than any limit leaves";
#endif
    auto settings = worker();
    settings.memory_limit = 8ULL << 20;
    bench::MeasureRequest request;
    request.problem = folder / "stops";
    request.solver.name = "misbehaving";
    const auto row = bench::measure(settings, request);
    EXPECT_TRUE(row.status == "crashed" || row.status == "error") << row.status;
}

TEST_F(BenchTest, DescribeTellsTheFacts) {
    const auto facts = bench::describe(worker(), folder / "friction", "coulomb");
    EXPECT_EQ(facts.name, "friction");
    EXPECT_EQ(facts.law, "coulomb");
    EXPECT_EQ(facts.m, 3);
    ASSERT_EQ(facts.cones.size(), 1U);
    EXPECT_EQ(facts.cones[0].first, "friction");
    EXPECT_THROW(static_cast<void>(bench::describe(worker(), folder / "absent", "")), InputError);
}

}  // namespace
}  // namespace delassus::bench_test::measurement_test
