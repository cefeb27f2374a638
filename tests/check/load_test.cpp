// SPDX-License-Identifier: BSD-3-Clause
// Misbehaving plugins through libdelassus: each gets its sentence, and the process goes on.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "delassus/error.hpp"
#include "delassus/solver.hpp"
#include "helpers.hpp"

namespace delassus::load_test {
namespace {

using test::fixture;
using test::known_problem;

/// The sentence of the exception that loading throws.
std::string refusal_of(const std::string& name) {
    try {
        static_cast<void>(Plugin::load(fixture(name)));
    } catch (const PluginError& error) {
        return error.what();
    }
    return "it was loaded";
}

TEST(Load, RefusesBrokenHandshakesWithASentence) {
    const std::pair<const char*, std::vector<const char*>> cases[] = {
        {"wrong_abi", {"99.6", "this is version 2.6"}},
        {"before_release", {"built for version 1.0", "this is version 2.6"}},
        {"wrong_magic", {"magic number"}},
        {"small_descriptor", {"24 bytes"}},
        {"bad_name", {"../Bad Name", "not a word"}},
        {"missing_operation", {"lacks the operation factorize"}},
        {"missing_symbol", {"not a Delassus plugin", "delassus_plugin"}},
        {"null_descriptor", {"returned nothing"}},
        {"throws_at_handshake", {"thrown at the handshake"}},
        {"duplicate_option", {"row 1", "used before"}},
        {"default_outside_range", {"factor", "from 0 to 1"}},
        {"no_such_plugin", {"there is no plugin"}},
    };
    for (const auto& [name, words] : cases) {
        const auto sentence = refusal_of(name);
        EXPECT_NE(sentence.find(fixture(name).string()), std::string::npos) << sentence;
        for (const char* word : words) EXPECT_NE(sentence.find(word), std::string::npos) << sentence;
    }
}

TEST(Load, RefusesAFileThatIsNoLibrary) {
    const test::TemporaryFolder folder;
    const auto path = folder.path() / "text.so";
    std::ofstream(path) << "this is not a shared library\n";
    try {
        static_cast<void>(Plugin::load(path));
        FAIL() << "it was loaded";
    } catch (const PluginError& error) {
        // The loader's own message must not be lost.
        EXPECT_NE(std::string(error.what()).find("file too short"), std::string::npos) << error.what();
    }
}

TEST(Load, TakesOtherMinorVersions) {
    const auto known = known_problem("friction_diagonal_coulomb");
    for (const auto& [name, minor] : {std::pair("older_minor", 0), std::pair("newer_minor", DELASSUS_ABI_MINOR + 7)}) {
        const auto plugin = Plugin::load(fixture(name));
        EXPECT_EQ(plugin->info().abi_minor, minor);
        Solver solver(plugin);
        Solution solution;
        EXPECT_EQ(solver.solve(PreparedProblem(known.problem), solution, {}).status, Status::Solved) << name;
    }
}

// What stands behind the end of an older descriptor is not the host's to read, let alone to call.
TEST(Load, ReadsNothingBehindAnOlderDescriptor) {
    EXPECT_EQ(Plugin::load(fixture("older_minor"))->descriptor().accepts, nullptr);
    EXPECT_NE(Plugin::load(fixture("newer_minor"))->descriptor().accepts, nullptr);
}

TEST(Load, KnowsWhetherAPluginWasOptimised) {
    EXPECT_EQ(Plugin::load(fixture("unoptimized"))->info().build, DELASSUS_BUILD_UNOPTIMIZED);
    EXPECT_EQ(Plugin::load(fixture("older_minor"))->info().build, DELASSUS_BUILD_UNKNOWN);
    EXPECT_EQ(Plugin::load(fixture("minimal"))->info().build, DELASSUS_BUILD_UNKNOWN);
#if defined(__OPTIMIZE__)
    EXPECT_EQ(Plugin::load(fixture("sweeps"))->info().build, DELASSUS_BUILD_OPTIMIZED);
#endif
    const auto names = unoptimized_plugins();
    EXPECT_NE(std::find(names.begin(), names.end(), "unoptimized"), names.end());
    EXPECT_EQ(std::find(names.begin(), names.end(), "minimal"), names.end());
}

TEST(Load, RefusesADescriptorShorterThanThatOfVersion20) {
    const auto sentence = refusal_of("short_descriptor");
    const auto needed = offsetof(delassus_plugin_descriptor, accepts);
    EXPECT_NE(sentence.find(std::to_string(needed - 8) + " bytes; " + std::to_string(needed) + " are needed"),
              std::string::npos)
        << sentence;
}

TEST(Solve, TakesAPluginInC) {
    const auto known = known_problem("unconstrained_diagonal");
    Solver solver(Plugin::load(fixture("minimal")));
    Solution solution;
    EXPECT_EQ(solver.solve(PreparedProblem(known.problem), solution, {}).status, Status::Solved);
    for (std::size_t i = 0; i < solution.x.size(); ++i) EXPECT_DOUBLE_EQ(solution.x[i], known.solution.x[i]);
}

TEST(Solve, ReportsExceptionsThroughTheBorder) {
    try {
        const Solver solver(Plugin::load(fixture("throws_in_create")));
        FAIL() << "a solver was made";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("thrown in create"), std::string::npos) << error.what();
    }
    const PreparedProblem problem(known_problem("free_diagonal").problem);
    const std::pair<const char*, const char*> cases[] = {{"throws_in_solve", "thrown in solve"},
                                                         {"throws_a_number", "exception through the plugin border"}};
    for (const auto& [name, words] : cases) {
        Solver solver(Plugin::load(fixture(name)));
        Solution solution;
        const auto report = solver.solve(problem, solution, {});
        EXPECT_EQ(report.status, Status::Error);
        EXPECT_NE(report.message.find(words), std::string::npos) << report.message;
        EXPECT_EQ(solution.x.size(), 3u);
    }
}

TEST(Solve, ReportsAFailureWithItsSentence) {
    Solver solver(Plugin::load(fixture("fails_to_factorize")));
    Solution solution;
    const auto report = solver.solve(PreparedProblem(known_problem("free_diagonal").problem), solution, {});
    EXPECT_EQ(report.status, Status::NumericalFailure);
    EXPECT_NE(report.message.find("the pivot vanished"), std::string::npos) << report.message;
}

TEST(Solve, ReplacesValuesThatAreNotFinite) {
    Solver solver(Plugin::load(fixture("returns_nan")));
    Solution solution;
    const auto report = solver.solve(PreparedProblem(known_problem("free_diagonal").problem), solution, {});
    EXPECT_EQ(report.status, Status::NumericalFailure);
    EXPECT_NE(report.message.find("not finite"), std::string::npos) << report.message;
    EXPECT_EQ(solution.x, std::vector<double>(3, 0.0));
    EXPECT_EQ(solution.lambda, std::vector<double>(2, 0.0));
    EXPECT_TRUE(std::isfinite(report.error.natural));
}

TEST(Solve, MarksAFalseClaim) {
    Solver solver(Plugin::load(fixture("claims_falsely")));
    Solution solution;
    const auto report = solver.solve(PreparedProblem(known_problem("free_diagonal").problem), solution, {});
    EXPECT_EQ(report.status, Status::FalseClaim);
    EXPECT_NE(report.message.find("claimed convergence"), std::string::npos) << report.message;
    EXPECT_GT(report.error.natural + report.error.balance, 1e-2);
}

TEST(Solve, TakesAnUnknownStatusForAnError) {
    Solver solver(Plugin::load(fixture("unknown_status")));
    Solution solution;
    const auto report = solver.solve(PreparedProblem(known_problem("free_diagonal").problem), solution, {});
    EXPECT_EQ(report.status, Status::Error);
}

TEST(Solve, GoesOnAfterAllOfThem) {
    const auto known = known_problem("mixed_definite");
    Solver solver(Plugin::load(fixture("sweeps")));
    Solution solution;
    EXPECT_EQ(solver.solve(PreparedProblem(known.problem), solution, {}).status, Status::Solved);
    for (std::size_t i = 0; i < solution.x.size(); ++i) EXPECT_NEAR(solution.x[i], known.solution.x[i], 1e-6);
}

}  // namespace
}  // namespace delassus::load_test
