// SPDX-License-Identifier: BSD-3-Clause
// The plugins that take problems in parts: the same velocities from any number of processes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "delassus/error.hpp"
#include "delassus/generate.hpp"
#include "delassus/prepared_part.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/solver_config.hpp"
#include "support/shared_problems.hpp"
#include "support/small_problems.hpp"

namespace delassus::solvers_test {
namespace {

struct Case {
    const char* plugin;
    double tolerance;   // of the natural error, small enough for velocities to 1e-9
    std::int64_t most;  // iterations; what takes more is compared after few
    std::int64_t few;   // 0: not compared, since iterates depend on the processes; Coulomb's velocities neither
    std::vector<Law> laws;
};

void PrintTo(const Case& given, std::ostream* out) {
    *out << given.plugin;
}

struct Answer {
    SolveReport report;
    std::vector<double> x, lambda;  // own
};

/// ‖x − y‖, ‖y‖ in the norm of diag H and the velocity without reactions, about H⁻¹a, squared; own rows.
void add_squares(const PartitionedProblem& part, std::int64_t first, const double* x, const double* y,
                 std::vector<double>& sums) {
    for (std::int64_t i = 0; i < part.n(); ++i) {
        const auto k = static_cast<std::size_t>(i);
        double h = 1.0;
        for (auto e = static_cast<std::size_t>(part.H.row_start[k]);
             e < static_cast<std::size_t>(part.H.row_start[k + 1]); ++e)
            if (part.H.column[e] == first + i) h = std::abs(part.H.value[e]);
        sums[0] += h * (x[i] - y[i]) * (x[i] - y[i]);
        sums[1] += h * y[i] * y[i];
        sums[2] += part.a[k] * part.a[k] / h;
    }
}

class PartitionedPlugins : public testing::TestWithParam<Case> {
protected:
    void SetUp() override {
        const auto& names = registry.plugins();
        if (std::none_of(names.begin(), names.end(), [&](const auto& info) { return info.name == GetParam().plugin; }))
            GTEST_SKIP() << GetParam().plugin << " was not built";
        SolverConfig config;
        config.name = GetParam().plugin;
        for (const auto& processes : {run, alone})
            solvers.emplace(processes.get(), make_solver(registry, config, *processes));
    }

    Answer solve(const std::shared_ptr<const Communicator>& processes, const PreparedPart& part, double tolerance,
                 std::int64_t most) {
        SolveSettings settings;
        settings.tolerance = tolerance;
        settings.max_iterations = most;
        Answer answer;
        Solution own;
        answer.report = solvers.at(processes.get()).solve(part, own, settings);
        answer.x = own.x;
        answer.lambda = own.lambda;
        return answer;
    }

    /// Whether all processes agree with one; false if the plugin refuses the problem.
    bool agrees(const Problem& problem) {
        const Case& given = GetParam();
        const PreparedPart whole(alone, part_of(*alone, problem));
        const PreparedPart part(run, part_of(*run, problem));
        SolveSettings settings;
        const bool refused = !solvers.at(alone.get()).refusal(whole, settings).empty();
        if (refused || !solvers.at(run.get()).refusal(part, settings).empty()) return false;
        std::int64_t most = given.most;
        Answer one = solve(alone, whole, given.tolerance, most);
        if (given.few == 0) {
            if (one.report.status != Status::Solved) return false;
            most *= 3;
        } else if (one.report.status != Status::Solved) {
            one = solve(alone, whole, given.tolerance, most = given.few);
        }
        const Answer all = solve(run, part, given.tolerance, most);
        const std::int64_t first = part.problem().column_start[static_cast<std::size_t>(run->rank())];
        std::vector<double> sums(3, 0.0);
        add_squares(part.problem(), first, all.x.data(), one.x.data() + first, sums);
        run->sum(sums);
        EXPECT_EQ(name_of(all.report.status), name_of(one.report.status)) << all.report.message;
        const bool unique = given.few > 0 || problem.law == Law::Associated;
        const double allowed = unique ? 1e-9 : std::numeric_limits<double>::infinity();
        EXPECT_LE(std::sqrt(sums[0]), allowed * std::sqrt(std::max(sums[1], sums[2])))
            << "after " << all.report.iterations << " and " << one.report.iterations << " iterations, natural "
            << all.report.error.natural << " and " << one.report.error.natural;
        compared[std::string(name_of(one.report.status))] += 1;
        return true;
    }

    void TearDown() override {
        if (run->rank() != 0) return;
        for (const auto& [status, count] : compared) RecordProperty(status, count);
    }

    const Registry registry;
    std::shared_ptr<const Communicator> run = communicator_of_run(), alone = single_process();
    std::map<const Communicator*, Solver> solvers;
    std::map<std::string, int> compared;
};

TEST_P(PartitionedPlugins, AgreeOnGeneratedProblems) {
    int taken = 0;
    for (const Generator& family : generators())
        for (const Law law : GetParam().laws) {
            SCOPED_TRACE(std::string(family.name) + (law == Law::Coulomb ? ", coulomb" : ""));
            Problem problem = generate(family.name, {});
            problem.law = law;
            if (agrees(problem)) ++taken;
        }
    EXPECT_GE(taken, 3);
    EXPECT_GE(compared["solved"], 2);
}

TEST_P(PartitionedPlugins, AgreeOnSharedProblems) {
    DELASSUS_REQUIRE_SHARED_PROBLEMS();
    int taken = 0;
    for (const auto& folder : tests::shared_problem_folders())
        for (const Law law : GetParam().laws) {
            SCOPED_TRACE(folder.filename().string() + (law == Law::Coulomb ? ", coulomb" : ""));
            Problem problem = read_problem(folder);
            problem.law = law;
            if (agrees(problem)) ++taken;
        }
    EXPECT_GE(taken, 3);
    EXPECT_GE(compared["solved"], 3);
}

TEST_P(PartitionedPlugins, TellWhatTheTimeGoesTo) {
    const PreparedPart part(run, part_of(*run, generate("sphere_pile", {{"contacts", 1000.0}})));
    const Answer answer = solve(run, part, 1e-3, 100);
    ASSERT_GE(answer.report.iterations, 5);
    const SolveCost& cost = answer.report.cost;
    double sum = 0.0;
    for (int k = 0; k < DELASSUS_PHASE_COUNT; ++k) {
        const double seconds = cost.phases[static_cast<std::size_t>(k)];
        EXPECT_GE(seconds, 0.0) << name_of(static_cast<delassus_phase>(k));
        sum += seconds;
    }
    EXPECT_GT(cost.phases[DELASSUS_PHASE_PRODUCTS], 0.0);
    EXPECT_GT(cost.phases[DELASSUS_PHASE_PROJECTIONS], 0.0);
    EXPECT_GT(cost.setup, 0.0);
    const bool sampled = std::string(GetParam().plugin) == "apgd_petsc";  // one iteration stands for 32
    // The core's clock stands still in its own callbacks, that of a sweep does not.
    const double callbacks = std::string(GetParam().plugin) == "pgs_petsc" ? 0.1 * cost.solve + 0.002 : 0.0;
    EXPECT_LE(sum, sampled ? 3.0 * cost.solve + 0.01 : 1.001 * cost.solve + callbacks);
    if (run->size() == 1) {
        EXPECT_EQ(cost.bytes_sent, 0);
        EXPECT_EQ(cost.phases[DELASSUS_PHASE_EXCHANGE] + cost.phases[DELASSUS_PHASE_WAITING], 0.0);
        return;
    }
    std::int64_t bytes = cost.bytes_sent;
    run->sum(std::span(&bytes, 1));
    EXPECT_GT(bytes, 0);
    EXPECT_GT(cost.phases[DELASSUS_PHASE_REDUCTIONS] + cost.phases[DELASSUS_PHASE_WAITING], 0.0);
    // apgd_petsc knows what one product sends; there is one an iteration, some more, and one reduction of 4 numbers.
    double told = 0.0;
    if (std::sscanf(answer.report.message.c_str(), "%*d processes together send %lf MB", &told) != 1) return;
    const double each = static_cast<double>(bytes) / static_cast<double>(answer.report.iterations);
    EXPECT_GE(each, 0.99 * 1e6 * told);
    EXPECT_LE(each, 1.5 * (1e6 * told + 32.0 * run->size()));
}

// More processes than bodies: most own nothing.
TEST_P(PartitionedPlugins, TakePartsThatAreEmpty) {
    EXPECT_TRUE(agrees(tests::point_on_plane(1.0, 1.0, 0.3, 0.5, Law::Associated)));
    EXPECT_TRUE(agrees(tests::tied_masses()));
}

// A plate of mass 50 on 40 points that rest on the floor: its column is everybody's.
TEST_P(PartitionedPlugins, TakeOneBodyThatTouchesAll) {
    constexpr std::int32_t points = 40;
    Problem problem;
    std::vector<double> masses(3 * (points + 1), 1.0);
    std::fill_n(masses.end() - 3, 3, 50.0);
    problem.H = tests::diagonal_matrix(masses);
    std::vector<Triplet> triplets;
    for (std::int32_t k = 0; k < points; ++k)
        for (std::int32_t i = 0; i < 3; ++i) {
            triplets.push_back({6 * k + i, 3 * k + i, 1.0});
            triplets.push_back({6 * k + 3 + i, 3 * k + i, -1.0});
            triplets.push_back({6 * k + 3 + i, 3 * points + i, 1.0});
        }
    problem.D = SparseMatrix::from_triplets(6 * points, 3 * (points + 1), std::move(triplets));
    for (std::size_t i = 0; i < masses.size(); ++i)
        problem.a.push_back(masses[i] * (i % 3 == 0 ? -1.0 : i % 3 == 1 ? 0.1 : 0.0));
    problem.a[static_cast<std::size_t>(3 * points) + 1] = 40.0;
    problem.b.assign(6 * points, 0.0);
    for (std::int32_t k = 0; k < 2 * points; ++k) problem.cones.push_back(Cone::friction(k % 2 == 0 ? 0.5 : 0.2));
    for (const Law law : GetParam().laws) {
        problem.law = law;
        EXPECT_TRUE(agrees(problem));
    }
    EXPECT_EQ(compared["solved"], static_cast<int>(GetParam().laws.size()));
}

/// Bodies on a line, each between two walls of its own. The walls of the first are nearer to each other than nothing:
/// x ≥ 1 and −x ≥ 1.
Problem squeezed(std::int32_t bodies) {
    Problem problem;
    problem.H = tests::diagonal_matrix(std::vector<double>(static_cast<std::size_t>(bodies), 2.0));
    std::vector<Triplet> triplets;
    for (std::int32_t k = 0; k < bodies; ++k) {
        triplets.push_back({2 * k, k, 1.0});
        triplets.push_back({2 * k + 1, k, -1.0});
        for (int side = 0; side < 2; ++side) {
            problem.b.push_back(k == 0 ? -1.0 : 0.5);
            problem.cones.push_back(Cone::nonnegative(1));
        }
        problem.a.push_back(0.3 * k - 1.0);
    }
    problem.D = SparseMatrix::from_triplets(2 * bodies, bodies, std::move(triplets));
    return problem;
}

// The proof is spread over the processes; auto stops at it.
TEST(PartitionedInfeasible, IpmProvesIt) {
    const Registry registry;
    const auto& names = registry.plugins();
    if (std::none_of(names.begin(), names.end(), [](const auto& info) { return info.name == "ipm_petsc"; }))
        GTEST_SKIP() << "ipm_petsc was not built";
    const auto run = communicator_of_run();
    const PreparedPart part(run, part_of(*run, squeezed(12)));
    for (const char* name : {"ipm_petsc", "auto"}) {
        SolverConfig config;
        config.name = name;
        Solver solver = make_solver(registry, config, *run);
        Solution own;
        const SolveReport report = solver.solve(part, own, {});
        EXPECT_EQ(name_of(report.status), name_of(Status::Infeasible)) << name << ": " << report.message;
    }
}

// Domains of a hundred bodies, and more processes than bodies.
TEST(PartitionedSchwarz, SolvesPiles) {
    const Registry registry;
    const auto& names = registry.plugins();
    if (std::none_of(names.begin(), names.end(), [](const auto& info) { return info.name == "ipm_petsc"; }))
        GTEST_SKIP() << "ipm_petsc was not built";
    const auto run = communicator_of_run();
    SolverConfig config;
    config.name = "ipm_petsc";
    config.options = {{"preconditioner", "schwarz"}, {"subdomain", "600"}};
    Solver solver = make_solver(registry, config, *run);
    SolveSettings settings;
    settings.tolerance = 1e-2;
    settings.max_iterations = 40;
    for (const Problem& problem :
         {generate("sphere_pile", {}), tests::point_on_plane(1.0, 1.0, 0.3, 0.5, Law::Associated)}) {
        const PreparedPart part(run, part_of(*run, problem));
        Solution own;
        const SolveReport report = solver.solve(part, own, settings);
        EXPECT_EQ(name_of(report.status), name_of(Status::Solved)) << report.message;
        EXPECT_NE(report.message.find("overlapping Schwarz"), std::string::npos) << report.message;
    }
}

INSTANTIATE_TEST_SUITE_P(All, PartitionedPlugins,
                         testing::Values(Case{"apgd_petsc", 1e-12, 5000, 10, {Law::Associated}},
                                         Case{"ipm_petsc", 1e-10, 100, 3, {Law::Associated}},
                                         Case{"admm_petsc", 1e-11, 300, 5, {Law::Associated, Law::Coulomb}},
                                         Case{"pgs_petsc", 1e-12, 1500, 0, {Law::Associated, Law::Coulomb}}),
                         [](const auto& each) { return std::string(each.param.plugin); });

}  // namespace
}  // namespace delassus::solvers_test
