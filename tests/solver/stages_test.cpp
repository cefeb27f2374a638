// SPDX-License-Identifier: BSD-3-Clause
// Solvers in stages: `finish`, `auto`, and the forecast that ends a stage.
#include "solver/stages.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "delassus/config.hpp"
#include "delassus/error.hpp"
#include "delassus/problem_files.hpp"
#include "solver/acceptance.hpp"
#include "solver/auto_solver.hpp"
#include "support/run_command.hpp"
#include "support/small_problems.hpp"

namespace delassus::tests::stages_test {
namespace {

const Registry& registry() {
    static const Registry instance;
    return instance;
}

using Verdict = Forecast::Verdict;

/// Feeds e(k) at the iterations that the forecast asks for: where it ends the turn and how, or (-1, GoOn).
template <class Error>
std::pair<std::int64_t, Verdict> ended_at(Forecast forecast, Error error, std::int64_t last) {
    for (std::int64_t k = 0; k <= last; ++k) {
        if (!forecast.due(k)) continue;
        const Verdict verdict = forecast.judge(k, error(static_cast<double>(k)));
        if (verdict != Verdict::GoOn) return {k, verdict};
    }
    return {-1, Verdict::GoOn};
}

constexpr std::pair<std::int64_t, Verdict> goes_on = {-1, Verdict::GoOn};

TEST(Forecast, ForetellsAlgebraicRates) {
    const auto algebraic = [](double k) { return 1.0 / (k * k); };
    // 1/k² reaches 1e-6 after 1000 iterations: in the turn, in twice its length, or not in that.
    EXPECT_EQ(ended_at(Forecast(1e-6, 1024), algebraic, 1000), goes_on);
    EXPECT_EQ(ended_at(Forecast(1e-6, 512), algebraic, 1000), goes_on);
    EXPECT_EQ(ended_at(Forecast(1e-6, 480), algebraic, 960), std::pair(std::int64_t{480}, Verdict::Exhausted));
}

TEST(Forecast, ForetellsLinearRatesAndPlateaus) {
    EXPECT_EQ(ended_at(
                  Forecast(1e-6, 1 << 20), [](double) { return 0.1; }, 1000),
              std::pair(std::int64_t{256}, Verdict::Pass));
    // e^(−k/100) reaches 1e-6 after 1382 iterations.
    EXPECT_EQ(ended_at(
                  Forecast(1e-6, 700), [](double k) { return std::exp(-0.01 * k); }, 1400),
              goes_on);
    EXPECT_EQ(ended_at(
                  Forecast(1e-6, 100), [](double) { return 1e-7; }, 200),
              goes_on)
        << "it is there already";
}

TEST(Forecast, EndsShortTurnsWhereTheyEnd) {
    EXPECT_EQ(ended_at(
                  Forecast(1e-6, 10), [](double) { return 0.1; }, 20),
              std::pair(std::int64_t{10}, Verdict::Exhausted));
    EXPECT_EQ(ended_at(
                  Forecast(1e-6, 10), [](double) { return std::nan(""); }, 20),
              std::pair(std::int64_t{10}, Verdict::Exhausted));
}

SolveReport solve(const SolverConfig& config, const PreparedProblem& problem, Solution& solution,
                  SolveSettings settings = {}) {
    if (config.tolerance) settings.tolerance = *config.tolerance;
    Solver solver = make_solver(registry(), config);
    return solver.solve(problem, solution, settings);
}

TEST(Finish, AnotherSolverTakesOver) {
    const PreparedProblem problem(read_problem(example("box_stack")));
    SolveSettings settings;
    settings.record_curve = true;
    Solution solution;
    const auto report = solve(parse_solver("spg(finish=apgd,finish_at=1e-2)"), problem, solution, settings);
    EXPECT_EQ(report.solver, "spg");
    EXPECT_EQ(report.options.at("finish"), "apgd");
    ASSERT_EQ(report.status, Status::Solved) << report.message;
    ASSERT_EQ(report.stages.size(), 2U);
    EXPECT_EQ(report.stages[0].solver, "spg");
    EXPECT_LE(report.stages[0].natural, 1e-2);
    EXPECT_GT(report.stages[0].natural, 1e-8) << "it stops where the finish takes over";
    EXPECT_EQ(report.stages[1].solver, "apgd");
    EXPECT_LE(report.error.natural, 1e-8);
    EXPECT_EQ(report.iterations, report.stages[0].iterations + report.stages[1].iterations);
    for (std::size_t k = 1; k < report.curve.size(); ++k) {
        EXPECT_GE(report.curve[k].seconds, report.curve[k - 1].seconds);
        EXPECT_GE(report.curve[k].iteration, report.curve[k - 1].iteration);
    }
    const auto json = nlohmann::json::parse(to_json(report));
    EXPECT_EQ(json["stages"].size(), 2U);
}

TEST(Finish, TheFirstGoesOnWhereTheFinishFails) {
    const PreparedProblem problem(read_problem(example("box_stack")));
    Solution solution;
    // One sweep of pgs does not finish anything.
    SolverConfig config = parse_solver("apgd(finish=pgs,finish_at=1e-2)");
    SolveSettings settings;
    settings.max_iterations = 100000;
    config.tolerance = 1e-9;
    const auto report = solve(config, problem, solution, settings);
    EXPECT_EQ(report.status, Status::Solved) << report.message;
    EXPECT_LE(report.error.natural, 1e-9);
}

TEST(Finish, BadUseIsExplained) {
    const auto sentence = [](const char* text) {
        try {
            check_solver(registry(), parse_solver(text));
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_EQ(sentence("apgd(finish=spg)"), "");
    EXPECT_NE(sentence("apgd(finish=spq)").find("did you mean \"spg\""), std::string::npos);
    EXPECT_NE(sentence("apgd(finish_at=1e-3)").find("finish must name it"), std::string::npos);
    EXPECT_NE(sentence("apgd(finish=spg,finish_at=2)").find("finish_at"), std::string::npos);
    const PreparedProblem problem(read_problem(example("box_stack")));
    Solution solution;
    EXPECT_THROW(static_cast<void>(solve(parse_solver("apgd(finish=minres)"), problem, solution)), Unsupported);
}

std::string ranking(const ScratchFolder& scratch, const std::string& rules) {
    const auto file = scratch / "ranking.json";
    std::ofstream(file) << R"({"format": 2, "made_by": "a test", "orders": )" << rules << "}";
    return file.string();
}

// The errors of an answer are measured once, whoever asks: of a solver's, of each stage's, and of a start that a stage
// may spoil.
TEST(Stages, MeasureEachAnswerOnce) {
    const auto measurements = [](const char* solver, bool warm = false) {
        const PreparedProblem problem(read_problem(example("box_stack")));
        Solution solution;
        SolveSettings settings;
        settings.warm_start = warm;
        solution.x.assign(static_cast<std::size_t>(problem.problem().n()), 0.0);
        solution.lambda.assign(static_cast<std::size_t>(problem.problem().m()), 0.0);
        const auto report = solve(parse_solver(solver), problem, solution, settings);
        EXPECT_EQ(report.status, Status::Solved) << report.message;
        const Errors again = ErrorMeter(problem).measure(solution.x, solution.lambda);
        for (const ErrorMeasure& measure : error_measures)
            EXPECT_EQ(report.error.*measure.value, again.*measure.value) << solver << ' ' << measure.name;
        return std::pair(problem.meter().measurements(), static_cast<std::int64_t>(report.stages.size()));
    };
    EXPECT_EQ(measurements("apgd"), std::pair(std::int64_t{1}, std::int64_t{0}));
    EXPECT_EQ(measurements("spg(finish=apgd,finish_at=1e-2)"), std::pair(std::int64_t{2}, std::int64_t{2}));
    const auto [count, stages] = measurements("auto");
    EXPECT_GE(stages, 1);
    EXPECT_EQ(count, stages);
    const auto [warm_count, warm_stages] = measurements("auto", true);
    EXPECT_EQ(warm_count, warm_stages + 1);
}

TEST(Auto, TakesTurnsInItsOrder) {
    const ScratchFolder scratch;
    const auto file = ranking(scratch, R"([
        {"name": "never", "when": {"linear": true}, "solvers": []},
        {"name": "all", "when": {}, "solvers": [
            {"solver": "pgs", "iterations": 2},
            {"solver": "absent", "iterations": 1},
            {"solver": "minres", "iterations": 1},
            {"solver": "apgd", "iterations": 3}]}])");
    const PreparedProblem problem(read_problem(example("box_stack")));
    Solution solution;
    SolveSettings settings;
    settings.max_iterations = 16;
    const auto report = solve(parse_solver("auto(ranking=" + file + ")"), problem, solution, settings);
    EXPECT_EQ(report.solver, "auto");
    EXPECT_EQ(report.message.substr(0, 4), "all:");
    ASSERT_GE(report.stages.size(), 2U) << report.message;
    EXPECT_EQ(report.stages[0].solver, "pgs");
    EXPECT_EQ(report.stages[0].iterations, 2);
    EXPECT_EQ(report.stages[0].reason, "round 1");
    EXPECT_EQ(report.stages[1].solver, "apgd") << "neither who is not installed nor who cannot take the problem";
    EXPECT_EQ(report.stages[1].iterations, 3);
    EXPECT_EQ(report.iterations, 16);
    EXPECT_EQ(report.status, Status::IterationLimit);
}

// The counts of a solver that is made of others are those of all of them, since it was made, whichever of them a solve
// has needed.
TEST(Auto, CountsAnalysesAndFactorizationsSinceItWasMade) {
    for (const char* text : {"auto", "apgd(finish=ssn,finish_at=1e-2)", "admm"}) {
        SCOPED_TRACE(text);
        const PreparedProblem problem(read_problem(example("walker")));
        Solver solver = make_solver(registry(), parse_solver(text));
        Solution solution;
        SolveSettings settings;
        std::int64_t analyses = 0, factorizations = 0;
        for (const bool warm : {false, true, false, true}) {
            settings.warm_start = warm;
            const auto report = solver.solve(problem, solution, settings);
            EXPECT_EQ(report.status, Status::Solved) << report.message;
            EXPECT_GE(report.analyses, analyses);
            EXPECT_GE(report.factorizations, factorizations);
            analyses = report.analyses;
            factorizations = report.factorizations;
        }
        EXPECT_GT(factorizations, 0);
        EXPECT_LE(analyses, 4) << "one pattern: one analysis by each solver";
    }
}

// In a simulation a start that is within the tolerance and moves is sharpened once. From then on, and at rest, no stage
// is needed, and what was counted before stays.
TEST(Auto, KeepsItsCountsWhereTheStartIsTheAnswer) {
    const PreparedProblem problem(read_problem(example("box_stack")));
    Solver solver = make_solver(registry(), parse_solver("auto"));
    Solution solution;
    SolveSettings settings;
    settings.tolerance = 1e-6;
    settings.origin = Origin::Step;
    const auto first = solver.solve(problem, solution, settings);
    ASSERT_EQ(first.status, Status::Solved) << first.message;
    settings.warm_start = true;
    const auto second = solver.solve(problem, solution, settings);
    EXPECT_LE(second.stages.size(), 1U);
    EXPECT_EQ(second.status, Status::Solved) << second.message;
    EXPECT_LE(second.error.natural, 1e-3 * settings.tolerance);
    const auto third = solver.solve(problem, solution, settings);
    EXPECT_TRUE(third.stages.empty());
    EXPECT_EQ(third.analyses, second.analyses);
    EXPECT_EQ(third.factorizations, second.factorizations);
    settings.tolerance = std::max(1.5 * third.error.natural, 1e-16);
    for (const bool stands : {true, false}) {
        settings.stands_still = [stands](std::span<const double>, double) { return stands; };
        EXPECT_EQ(solver.solve(problem, solution, settings).stages.empty(), stands);
    }
}

// A tolerance that is a goal may be missed, the farther the more work was spent; another may not.
TEST(Auto, EndsNearAToleranceThatIsAGoal) {
    const PreparedProblem problem(read_problem(example("box_stack")));
    for (const double loosest : {1e-3, 0.0}) {
        Solution solution;
        SolveSettings settings;
        settings.tolerance = 1e-17;  // beyond what rounding allows
        settings.loosest = loosest;
        const auto report = solve(parse_solver("auto"), problem, solution, settings);
        EXPECT_NE(report.status, Status::Solved) << report.message;
        EXPECT_EQ(report.near_goal, loosest > 0.0);
        if (loosest > 0.0) {
            EXPECT_LE(report.error.natural, loosest);
        } else {
            EXPECT_NE(report.message.find("in three rounds"), std::string::npos) << report.message;
        }
    }
}

TEST(AcceptableError, GrowsWithTheWorkUpToTheLoosest) {
    SolveSettings settings;
    settings.tolerance = 1e-8;
    EXPECT_EQ(acceptable_error(settings, 5.0), 1e-8) << "a promise";
    settings.loosest = 1e-4;
    EXPECT_DOUBLE_EQ(acceptable_error(settings, 0.0), 1e-8);
    EXPECT_DOUBLE_EQ(acceptable_error(settings, 1.0), 1e-8);
    EXPECT_NEAR(acceptable_error(settings, 2.0), 1e-6, 1e-18);
    EXPECT_NEAR(acceptable_error(settings, 4.0), 1e-5, 1e-17);
    EXPECT_NEAR(acceptable_error(settings, 1e9), 1e-4, 1e-11);
    settings.loosest = 1e-9;
    EXPECT_EQ(acceptable_error(settings, 3.0), 1e-8) << "never below the tolerance";
}

// A servo holds against dry friction: their impulses cancel, so that rounding is large beside what is left of the
// momentum. What the later stage solved counts, although the earlier one balances better.
TEST(Auto, TakesTheAnswerThatIsSolved) {
    const ScratchFolder scratch;
    const auto file = ranking(scratch, R"([{"name": "all", "when": {}, "solvers": [
        {"solver": "pgs", "options": {"omega": "1"}, "iterations": 3},
        {"solver": "ssn", "iterations": 100}]}])");
    Problem data;
    data.H = SparseMatrix::from_triplets(1, 1, {{0, 0, 0.7001}});
    data.a = {1.49057e-19};
    data.b = {0.0, -0.00659103};
    data.D = SparseMatrix::from_triplets(2, 1, {{0, 0, 1.0}, {1, 0, 1.0}});
    data.E = SparseMatrix::from_triplets(2, 2, {{1, 1, 49.505}});
    data.cones = {Cone::box({-0.0002}, {0.0002}), Cone::box({-0.015}, {0.015})};
    Solution solution;
    const PreparedProblem problem(data);
    const auto report = solve(parse_solver("auto(ranking=" + file + ")"), problem, solution);
    EXPECT_EQ(report.status, Status::Solved) << report.message;
    EXPECT_LE(report.error.natural, 1e-8);
    EXPECT_NEAR(solution.lambda[1], 0.00659103 / 49.505, 1e-12);
    EXPECT_NEAR(solution.lambda[0] + solution.lambda[1], 0.0, 1e-12);
}

// An order without a solver that gets there: everyone else who can has turns too.
TEST(Auto, GoesOnWithWhoeverCan) {
    const ScratchFolder scratch;
    const auto file = ranking(scratch, R"([{"name": "all", "when": {}, "solvers": [
        {"solver": "pgs", "iterations": 1}]}])");
    const PreparedProblem problem(read_problem(example("box_stack")));
    Solution solution;
    const auto report = solve(parse_solver("auto(ranking=" + file + ")"), problem, solution);
    EXPECT_EQ(report.status, Status::Solved) << report.message;
    EXPECT_EQ(report.stages[0].solver, "pgs");
    EXPECT_EQ(report.stages[0].status, Status::IterationLimit);
    EXPECT_GE(report.stages.size(), 2U);
}

// A solver may take the other law, as a start; the problem's own law judges.
TEST(Auto, AMemberMayTakeTheOtherLaw) {
    const ScratchFolder scratch;
    const auto file = ranking(scratch, R"([{"name": "all", "when": {}, "solvers": [
        {"solver": "apgd", "law": "associated", "iterations": 1000},
        {"solver": "pgs", "iterations": 1000}]}])");
    const PreparedProblem problem(point_on_plane(2.0, 10.0, 8.0, 0.5, Law::Coulomb));
    Solution solution;
    const auto report = solve(parse_solver("auto(ranking=" + file + ")"), problem, solution);
    ASSERT_EQ(report.status, Status::Solved) << report.message;
    ASSERT_EQ(report.stages.size(), 2U);
    EXPECT_EQ(report.stages[0].law, Law::Associated);
    EXPECT_GT(report.stages[0].natural, 1e-3) << "a sliding contact opens under the associated law";
    EXPECT_NEAR(solution.x[1], (8.0 - 0.5 * 10.0) / 2.0, 1e-7);
    EXPECT_NEAR(solution.x[0], 0.0, 1e-7);
}

// A plugin that is there for comparisons works only where an order names it.
TEST(Auto, NeverTurnsToAPeerByItself) {
    const ScratchFolder scratch;
    const auto add_plugin = [&](const std::string& name, std::uint32_t flags) {
        PluginInfo info;
        info.name = name;
        info.abi_major = DELASSUS_ABI_MAJOR;
        info.flags = flags;
        info.capabilities = registry().find("pgs").capabilities;
        info.library = scratch / (name + ".so");
        std::ofstream(info.library) << "never loaded";
        std::ofstream(scratch / (name + ".json")) << sidecar_text(info);
    };
    add_plugin("helper", 0);
    add_plugin("peer", DELASSUS_FLAG_PEER);
    const Registry with_both({scratch.path()});
    const std::uint64_t needs = PreparedProblem(point_on_plane(2.0, 10.0, 8.0, 0.5, Law::Coulomb)).needs();
    const auto later = [&](const std::string& stages) {
        const auto file = ranking(scratch, R"([{"name": "all", "when": {}, "solvers": [)" + stages + "]}]");
        const auto choice = auto_choice(with_both, {{"ranking", file}}, needs, Origin::Alone);
        return std::set<std::string>(choice.later.begin(), choice.later.end());
    };
    const std::string pgs = R"({"solver": "pgs", "iterations": 10})";
    EXPECT_TRUE(later(pgs).contains("helper"));
    EXPECT_FALSE(later(pgs).contains("peer"));
    EXPECT_TRUE(later(pgs + R"(, {"solver": "peer", "iterations": 10})").contains("peer"));
}

// A warm start may hold velocities of another time: its small natural error is no success.
TEST(Auto, AStartThatDoesNotBalanceIsNoSolution) {
    const PreparedProblem problem(point_on_plane(2.0, 10.0, 3.0, 0.5, Law::Associated));  // it sticks: λ = −a, x = 0
    Solution solution{{1.0, -1.0, 2.0}, {10.0, -3.0, 0.0}};
    const ScratchFolder scratch;
    const auto file = ranking(scratch, R"([{"name": "all", "when": {}, "solvers": [
        {"solver": "apgd", "iterations": 1000}]}])");
    SolveSettings settings;
    settings.warm_start = true;
    const auto report = solve(parse_solver("auto(ranking=" + file + ")"), problem, solution, settings);
    EXPECT_EQ(report.status, Status::Solved) << report.message;
    for (const double x : solution.x) EXPECT_NEAR(x, 0.0, 1e-7);
}

/// A body between two walls that are nearer to each other than nothing: x ≥ 1 and −x ≥ 1.
Problem squeezed() {
    Problem problem;
    problem.H = SparseMatrix::from_triplets(1, 1, {{0, 0, 1.0}});
    problem.D = SparseMatrix::from_triplets(2, 1, {{0, 0, 1.0}, {1, 0, -1.0}});
    problem.a = {0.0};
    problem.b = {-1.0, -1.0};
    problem.cones = {Cone::nonnegative(2)};
    return problem;
}

// A proof that there is no solution ends the search; the best answer stays the one that comes nearest.
TEST(Auto, EndsWhereThereIsNoSolution) {
    const ScratchFolder scratch;
    const auto file = ranking(scratch, R"([{"name": "all", "when": {}, "solvers": [
        {"solver": "apgd", "iterations": 50},
        {"solver": "ipm", "iterations": 50},
        {"solver": "ssn", "iterations": 50}]}])");
    const PreparedProblem problem(squeezed());
    Solution solution;
    const auto report = solve(parse_solver("auto(ranking=" + file + ")"), problem, solution);
    EXPECT_EQ(report.status, Status::Infeasible) << report.message;
    ASSERT_EQ(report.stages.size(), 2U) << report.message;
    EXPECT_EQ(report.stages[1].solver, "ipm");
    EXPECT_LE(report.error.natural, report.stages[0].natural);
    EXPECT_EQ(solve(parse_solver("auto"), problem, solution).status, Status::Infeasible);
}

TEST(Auto, OrdersLookAtTheProblemAndItsUse) {
    const ScratchFolder scratch;
    const auto file = ranking(scratch, R"([
        {"name": "steps", "when": {"step": true}, "solvers": [{"solver": "pgs", "iterations": 9}]},
        {"name": "joints", "when": {"linear": true}, "solvers": [{"solver": "cholmod", "iterations": 9}]},
        {"name": "coulomb", "when": {"law": "coulomb"}, "solvers": [{"solver": "admm", "iterations": 9}]},
        {"name": "small", "when": {"m": [0, 5]}, "solvers": [{"solver": "ssn", "iterations": 9}]},
        {"name": "all", "when": {}, "solvers": [{"solver": "apgd", "iterations": 9}]}])");
    const auto first = [&](const Problem& problem, Origin origin = Origin::Alone) {
        SolveSettings settings;
        settings.tolerance = 1e-6;
        settings.origin = origin;
        Solution solution;
        const auto solver = parse_solver("auto(ranking=" + file + ")");
        return solve(solver, PreparedProblem(problem), solution, settings).stages.front().solver;
    };
    const Problem contact = point_on_plane(2.0, 10.0, 3.0, 0.5, Law::Associated);
    EXPECT_EQ(first(contact), "ssn");
    EXPECT_EQ(first(contact, Origin::Step), "pgs");
    EXPECT_EQ(first(point_on_plane(2.0, 10.0, 3.0, 0.5, Law::Coulomb)), "admm");
    EXPECT_EQ(first(tied_masses()), "cholmod");
    EXPECT_EQ(first(read_problem(example("box_stack"))), "apgd");
    // The law of a problem without friction says nothing.
    Problem frictionless = squeezed();
    frictionless.law = Law::Coulomb;
    frictionless.b = {-1.0, 1.0};
    EXPECT_EQ(first(frictionless), "ssn");
}

TEST(Auto, BadRankingsAreRefused) {
    const ScratchFolder scratch;
    const auto sentence = [&](const std::string& orders) {
        try {
            static_cast<void>(make_solver(registry(), parse_solver("auto(ranking=" + ranking(scratch, orders) + ")")));
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_NE(sentence("[]").find("last order must match everything"), std::string::npos);
    EXPECT_NE(sentence(R"([{"name": "a", "when": {"lwa": "coulomb"}, "solvers": []}])").find("did you mean \"law\""),
              std::string::npos);
    EXPECT_NE(sentence(R"([{"name": "a", "when": {}, "solvers": [{"solver": "pgs", "iterations": 0}]}])")
                  .find("0 iterations"),
              std::string::npos);
    EXPECT_NE(sentence("[{]").find("cannot be read"), std::string::npos);
    EXPECT_THROW(static_cast<void>(make_solver(registry(), parse_solver("auto(ranking=/no/such/file)"))), InputError);
    EXPECT_THROW(static_cast<void>(make_solver(registry(), parse_solver("auto(rankin=x)"))), InputError);
}

}  // namespace
}  // namespace delassus::tests::stages_test
