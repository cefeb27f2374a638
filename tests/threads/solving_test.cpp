// SPDX-License-Identifier: BSD-3-Clause
// Solvers that use the host's threads, and solvers in several threads of the host.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <memory>
#include <thread>

#include "delassus/generate.hpp"
#include "delassus/solver.hpp"
#include "support/places.hpp"
#include "support/solving.hpp"

namespace delassus::solving_in_threads_test {
namespace {

using tests::to;

// Under ThreadSanitizer all takes thirty times longer; a race shows in few iterations as well.
#if defined(__SANITIZE_THREAD__)
constexpr double tolerance = 1e-3;
#else
constexpr double tolerance = 1e-5;
#endif

std::string path_of(const std::string& plugin) {
    return std::string(tests::places::plugins) + "/" + plugin + ".so";
}

Problem pile(std::int32_t contacts) {
    SpherePileParameters parameters;
    parameters.contacts = contacts;
    parameters.speed = 0.5;
    return generate_sphere_pile(parameters);
}

tests::Solved solve(const std::string& plugin, const Problem& problem, SolveSettings settings, int threads) {
    settings.team = std::make_shared<ThreadTeam>(threads);
    return tests::solve_with(path_of(plugin), problem, settings, {});
}

class Threads : public testing::TestWithParam<std::string> {};

TEST_P(Threads, DoNotChangeTheAnswer) {
    for (const bool elastic : {false, true}) {
        const Problem problem = elastic ? generate_elastic_block({}) : pile(2500);
        const auto one = solve(GetParam(), problem, to(tolerance), 1);
        EXPECT_EQ(one.report.status, Status::Solved);
        for (const int threads : {2, 3}) {
            const auto several = solve(GetParam(), problem, to(tolerance), threads);
            EXPECT_EQ(one.solution.lambda, several.solution.lambda);
            EXPECT_EQ(one.solution.x, several.solution.x);
            EXPECT_EQ(one.report.iterations, several.report.iterations);
        }
    }
}

TEST(PgsThreads, DoNotChangeTheAnswerUnderTheCoulombLaw) {
    Problem problem = pile(2100);
    problem.law = Law::Coulomb;
    for (const char* ordering : {"auto", "coloured"}) {
        // It does not converge here; two hundred sweeps are enough to tell.
        std::vector<double> lambda[2];
        for (const int threads : {1, 2}) {
            SolveSettings settings = to(1e-5, 200);
            settings.team = std::make_shared<ThreadTeam>(threads);
            const auto [solution, report] =
                tests::solve_with(path_of("pgs"), problem, settings, {{"ordering", ordering}});
            EXPECT_EQ(report.iterations, 200);
            lambda[threads - 1] = solution.lambda;
        }
        EXPECT_EQ(lambda[0], lambda[1]) << ordering;
    }
}

/// Two threads of the host, each with a problem and a solver of its own, which has two threads and tells its progress.
TEST_P(Threads, SolversInTwoThreadsOfTheHostDoNotMeet) {
    const Problem problems[2] = {pile(750), pile(2100)};
    SolveSettings settings = to(tolerance);
    settings.record_curve = true;
    std::vector<double> alone[2], together[2];
    for (int k = 0; k < 2; ++k) alone[k] = solve(GetParam(), problems[k], settings, 2).solution.lambda;
    std::atomic<int> samples = 0;
    settings.on_sample = [&](const CurveSample&) { ++samples; };
    std::vector<std::jthread> hosts;
    for (int k = 0; k < 2; ++k)
        hosts.emplace_back([&, k] {
            for (int repeat = 0; repeat < 3; ++repeat)
                together[k] = solve(GetParam(), problems[k], settings, 2).solution.lambda;
        });
    hosts.clear();
    EXPECT_GT(samples, 0);
    for (int k = 0; k < 2; ++k) EXPECT_EQ(together[k], alone[k]);
}

/// The iterates shown along the way are whole: none is being written by another thread meanwhile.
TEST_P(Threads, ShowWholeIterates) {
    const Problem problem = pile(2100);
    std::vector<double> last;
    SolveSettings settings = to(tolerance);
    settings.give_up = [&](std::int64_t, const double*, const double* lambda) {
        last.assign(lambda, lambda + problem.m());
        return false;
    };
    const auto solved = solve(GetParam(), problem, settings, 2);
    EXPECT_EQ(solved.report.status, Status::Solved);
    EXPECT_EQ(last.size(), static_cast<std::size_t>(problem.m()));
}

/// Another thread of the host says when to stop.
TEST_P(Threads, AreCancelledFromAnother) {
    std::atomic<bool> stop = false, running = false;
    SolveSettings settings = to(1e-300);
    settings.on_progress = [&](const CurveSample&) { running = true; };
    settings.cancelled = [&] { return stop.load(); };
    const std::jthread other([&] {
        while (!running) std::this_thread::yield();
        stop = true;
    });
    const auto solved = solve(GetParam(), pile(2100), settings, 2);
    running = true;
    EXPECT_EQ(solved.report.status, Status::Cancelled);
}

INSTANTIATE_TEST_SUITE_P(Solvers, Threads, testing::Values("pgs", "apgd", "spg"),
                         [](const auto& given) { return given.param; });

TEST(Identities, OfProblemsMadeInTwoThreadsDiffer) {
    std::vector<std::uint64_t> identities[2];
    std::vector<std::jthread> hosts;
    for (auto& own : identities)
        hosts.emplace_back([&own] {
            PreparedProblem problem(pile(20));
            for (int k = 0; k < 100; ++k) {
                Problem next = pile(20);
                for (double& entry : next.H.value) entry *= 2.0 + k;  // new values, hence a new identity
                problem.renew(std::move(next));
                own.push_back(problem.raw().values_id);
            }
        });
    hosts.clear();
    for (const auto identity : identities[0]) EXPECT_EQ(std::ranges::count(identities[1], identity), 0);
}

}  // namespace
}  // namespace delassus::solving_in_threads_test
