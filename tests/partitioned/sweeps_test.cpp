// SPDX-License-Identifier: BSD-3-Clause
// pgs_petsc: sweeps of several processes on one problem, on bodies that are split between them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "delassus/error.hpp"
#include "delassus/generate_partitioned.hpp"
#include "delassus/prepared_part.hpp"
#include "delassus/solver_config.hpp"
#include "support/small_problems.hpp"

namespace delassus::partitioned_sweeps_test {
namespace {

class PartitionedSweeps : public testing::Test {
protected:
    void SetUp() override {
        const auto& names = registry.plugins();
        if (std::none_of(names.begin(), names.end(), [](const auto& info) { return info.name == "pgs_petsc"; }))
            GTEST_SKIP() << "pgs_petsc was not built";
    }

    [[nodiscard]] Solver solver(const std::shared_ptr<const Communicator>& processes, OptionTexts options = {}) const {
        SolverConfig config;
        config.name = "pgs_petsc";
        config.options = std::move(options);
        return make_solver(registry, config, *processes);
    }

    [[nodiscard]] PartitionedProblem pile(const Communicator& processes, std::uint64_t contacts, Law law,
                                          std::uint64_t seed = 1) const {
        PileParameters parameters;
        parameters.contacts = contacts;
        parameters.speed = 0.31;
        parameters.seed = seed;
        PartitionedProblem problem = generate_partitioned(processes, parameters);
        problem.law = law;
        return problem;
    }

    /// ½λᵀNλ + rᵀλ up to a constant: ½ xᵀHx − aᵀH⁻¹a/2 + ½λᵀEλ + bᵀλ with x = H⁻¹(a + Dᵀλ).
    [[nodiscard]] double objective(const PartitionedProblem& part, const Solution& own) const {
        const std::int64_t first = part.column_start[static_cast<std::size_t>(run->rank())];
        std::vector<double> sum(1, 0.0);
        for (std::int64_t i = 0; i < part.n(); ++i)
            for (auto e = static_cast<std::size_t>(part.H.row_start[static_cast<std::size_t>(i)]);
                 e < static_cast<std::size_t>(part.H.row_start[static_cast<std::size_t>(i) + 1]); ++e)
                sum[0] += 0.5 * own.x[static_cast<std::size_t>(i)] * part.H.value[e] *
                          own.x[static_cast<std::size_t>(part.H.column[e] - first)];
        for (std::size_t i = 0; i < own.lambda.size(); ++i) sum[0] += part.b[i] * own.lambda[i];
        run->sum(sum);
        return sum[0];
    }

    const Registry registry;
    std::shared_ptr<const Communicator> run = communicator_of_run(), alone = single_process();
};

// One process takes the sweeps of pgs.
TEST_F(PartitionedSweeps, OfOneProcessAreThoseOfPgs) {
    if (run->size() > 1) GTEST_SKIP() << "pgs takes no part in a run of several processes";
    for (const Law law : {Law::Associated, Law::Coulomb}) {
        PileParameters parameters;
        parameters.contacts = 2000;
        Problem whole = generate_pile(parameters);
        whole.law = law;
        SolveSettings settings;
        settings.tolerance = 1e-4;
        Solver pgs(registry.load("pgs"));
        Solution expected;
        const SolveReport serial = pgs.solve(PreparedProblem(whole), expected, settings);
        const PreparedPart part(alone, part_of(*alone, whole));
        Solution own;
        const SolveReport report = solver(alone).solve(part, own, settings);
        ASSERT_EQ(report.status, Status::Solved) << report.message;
        EXPECT_EQ(report.iterations, serial.iterations);
        EXPECT_EQ(own.lambda, expected.lambda);
    }
}

// Whatever the processes do at the same time, together they lower the objective in every sweep, as on one.
TEST_F(PartitionedSweeps, LowerTheObjective) {
    const PreparedPart part(run, pile(*run, 300, Law::Associated));
    for (const char* local : {"diagonal", "exact"}) {
        Solver sweeps = solver(run, {{"acceleration", "none"}, {"local_solver", local}});
        Solution own;
        own.x.assign(static_cast<std::size_t>(part.problem().n()), 0.0);
        own.lambda.assign(static_cast<std::size_t>(part.problem().m()), 0.0);
        SolveSettings settings;
        settings.tolerance = 1e-17;  // all iterations, and the last iterate
        settings.warm_start = true;
        double latest = std::numeric_limits<double>::infinity();
        for (int k = 1; k <= 10; ++k) {
            settings.max_iterations = 1;
            sweeps.solve(part, own, settings);
            const double now = objective(part.problem(), own);
            EXPECT_LT(now, latest) << local << ", sweep " << k;
            latest = now;
        }
    }
}

// At nearly the rate of one process: the bound is 1.3 on the average of some piles, since the ends of sweeps are looked
// at five by five.
TEST_F(PartitionedSweeps, OfManyProcessesAreHardlyMoreThanOfOne) {
    for (const Law law : {Law::Associated, Law::Coulomb}) {
        std::int64_t one = 0, all = 0;
        Solver of_run = solver(run), of_one = solver(alone);
        for (std::uint64_t seed = 1; seed <= 2; ++seed) {
            SolveSettings settings;
            settings.tolerance = 1e-3;
            Solution own, expected;
            const PreparedPart part(run, pile(*run, 2500, law, seed));
            const PreparedPart whole(alone, pile(*alone, 2500, law, seed));
            const SolveReport report = of_run.solve(part, own, settings);
            const SolveReport serial = of_one.solve(whole, expected, settings);
            ASSERT_EQ(report.status, Status::Solved) << report.message;
            ASSERT_EQ(serial.status, Status::Solved) << serial.message;
            EXPECT_LE(report.error.natural, settings.tolerance);
            all += report.iterations;
            one += serial.iterations;
        }
        RecordProperty(law == Law::Coulomb ? "coulomb" : "associated",
                       std::to_string(all) + " sweeps against " + std::to_string(one));
        const double bound = run->size() <= 3 ? 1.3 : 1.5;  // on eight, half of the bodies are shared
        EXPECT_LE(static_cast<double>(all), bound * static_cast<double>(one));
    }
}

// The steps of a simulation: another pattern each time, with one solver, from what was found before.
TEST_F(PartitionedSweeps, TakeNewPatternsOneAfterAnother) {
    Solver sweeps = solver(run);
    for (int step = 0; step < 4; ++step) {
        const PreparedPart part(run, pile(*run, 300 + 40 * static_cast<std::uint64_t>((7 * step) % 5), Law::Coulomb,
                                          step % 2 == 0 ? 1 : 2));
        SolveSettings settings;
        settings.tolerance = 1e-4;
        Solution own;
        ASSERT_EQ(sweeps.solve(part, own, settings).status, Status::Solved) << step;
        settings.warm_start = true;
        const SolveReport again = sweeps.solve(part, own, settings);
        EXPECT_EQ(again.status, Status::Solved);
        EXPECT_EQ(again.iterations, 0) << step;
        EXPECT_LE(part.measure(own.x, own.lambda).natural, 1e-4);
    }
}

// Rows of a diagonal E, and of each kind of cone, on bodies that all processes share.
TEST_F(PartitionedSweeps, ShareBodiesUnderAllKindsOfRows) {
    constexpr std::int32_t bodies = 24;
    Problem whole;
    std::vector<double> masses;
    for (std::int32_t i = 0; i < bodies; ++i) masses.push_back(1.0 + 0.37 * i);
    whole.H = tests::diagonal_matrix(masses);
    std::vector<Triplet> triplets;
    std::int32_t row = 0;
    const auto put = [&](std::int32_t i, std::int32_t j) {  // both ends of the run of bodies in each block
        triplets.push_back({row, i, 1.0});
        triplets.push_back({row++, j, -0.9});
    };
    for (std::int32_t k = 0; k + 3 < bodies; ++k) {
        switch (k % 4) {
            case 0:
                whole.cones.push_back(Cone::friction(0.4));
                for (std::int32_t i = 0; i < 3; ++i) put(k + i, bodies - 1 - i);
                break;
            case 1:
                whole.cones.push_back(Cone::nonnegative(1));
                put(k, k + 3);
                break;
            case 2:
                whole.cones.push_back(Cone::box({-0.2, -0.1}, {0.3, 0.1}));
                put(k, k + 1);
                put(0, k + 2);
                break;
            default:
                whole.cones.push_back(Cone::free(1));
                put(k, bodies / 2);
        }
    }
    whole.D = SparseMatrix::from_triplets(row, bodies, std::move(triplets));
    std::vector<double> compliance;
    for (std::int32_t i = 0; i < row; ++i) compliance.push_back(0.01 + 0.003 * (i % 5));
    whole.E = tests::diagonal_matrix(compliance);
    for (std::int32_t i = 0; i < bodies; ++i) whole.a.push_back(std::sin(1.7 * i) - 0.4);
    for (std::int32_t i = 0; i < row; ++i) whole.b.push_back(0.2 * std::cos(2.3 * i));
    for (const char* variant : {"forward", "symmetric", "jacobi"}) {
        SolveSettings settings;
        settings.tolerance = 1e-11;
        const PreparedPart part(run, part_of(*run, whole)), at_once(alone, part_of(*alone, whole));
        Solution own, expected;
        const SolveReport report = solver(run, {{"variant", variant}}).solve(part, own, settings);
        ASSERT_EQ(report.status, Status::Solved) << report.message;
        ASSERT_EQ(solver(alone).solve(at_once, expected, settings).status, Status::Solved);
        const auto first = static_cast<std::size_t>(part.problem().column_start[static_cast<std::size_t>(run->rank())]);
        for (std::size_t i = 0; i < own.x.size(); ++i) EXPECT_NEAR(own.x[i], expected.x[first + i], 1e-9) << variant;
        const auto first_row =
            static_cast<std::size_t>(part.problem().row_start[static_cast<std::size_t>(run->rank())]);
        for (std::size_t i = 0; i < own.lambda.size(); ++i)  // E makes it unique
            EXPECT_NEAR(own.lambda[i], expected.lambda[first_row + i], 1e-8) << variant;
    }
}

// Blocks of four velocities, of which rows touch the first alone: the others of the last block of a part lie behind all
// that its sweeps touch.
TEST_F(PartitionedSweeps, ShareVelocitiesThatNoRowTouches) {
    const std::int32_t bodies = 1201 * run->size();
    Problem whole;
    std::vector<Triplet> H, D;
    std::vector<double> compliance;
    for (std::int32_t k = 0; k < bodies; ++k)
        for (std::int32_t i = 0; i < 4; ++i)
            for (std::int32_t j = 0; j < 4; ++j) H.push_back({4 * k + i, 4 * k + j, i == j ? 2.0 + 0.1 * i : 0.3});
    whole.H = SparseMatrix::from_triplets(4 * bodies, 4 * bodies, std::move(H));
    for (std::int32_t k = 0; k + 1 < bodies; ++k) {
        D.push_back({k, 4 * k, 1.0});
        D.push_back({k, 4 * k + 4, -1.0});
        whole.cones.push_back(Cone::nonnegative(1));
        compliance.push_back(0.5);
        whole.b.push_back(std::sin(1.3 * k));
    }
    whole.D = SparseMatrix::from_triplets(bodies - 1, 4 * bodies, std::move(D));
    whole.E = tests::diagonal_matrix(compliance);
    for (std::int32_t i = 0; i < 4 * bodies; ++i) whole.a.push_back(std::cos(0.7 * i));
    SolveSettings settings;
    settings.tolerance = 1e-11;
    const PreparedPart part(run, part_of(*run, whole)), at_once(alone, part_of(*alone, whole));
    Solution own, expected;
    ASSERT_EQ(solver(run).solve(part, own, settings).status, Status::Solved);
    ASSERT_EQ(solver(alone).solve(at_once, expected, settings).status, Status::Solved);
    const auto first = static_cast<std::size_t>(part.problem().column_start[static_cast<std::size_t>(run->rank())]);
    for (std::size_t i = 0; i < own.x.size(); ++i) ASSERT_NEAR(own.x[i], expected.x[first + i], 1e-8) << i;
}

TEST_F(PartitionedSweeps, ComeFirstInStepsOfASimulation) {
    for (const Law law : {Law::Associated, Law::Coulomb})
        for (const bool simulation : {true, false}) {
            SolverConfig config;
            config.name = "auto";
            const PreparedPart part(run, pile(*run, 200, law));
            SolveSettings settings;
            settings.tolerance = 1e-2;
            if (simulation) settings.origin = Origin::Step;
            Solution own;
            const SolveReport report = make_solver(registry, config, *run).solve(part, own, settings);
            ASSERT_EQ(report.status, Status::Solved) << report.message;
            ASSERT_EQ(report.stages.size(), 1U) << report.message;
            const bool sweeps = simulation || law == Law::Coulomb;
            EXPECT_EQ(report.stages.front().solver, sweeps ? "pgs_petsc" : "apgd_petsc");
        }
}

TEST_F(PartitionedSweeps, RefuseComplianceBetweenRows) {
    Problem whole = tests::point_on_plane(1.0, 1.0, 0.3, 0.5, Law::Associated);
    whole.E = SparseMatrix::from_triplets(whole.m(), whole.m(),
                                          {{0, 0, 1.0}, {0, 1, 0.1}, {1, 0, 0.1}, {1, 1, 1.0}, {2, 2, 1.0}});
    const PreparedPart part(run, part_of(*run, whole));
    Solution own;
    const SolveReport report = solver(run).solve(part, own, {});
    EXPECT_EQ(report.status, Status::Error);
    EXPECT_NE(report.message.find("E couples rows"), std::string::npos) << report.message;
}

}  // namespace
}  // namespace delassus::partitioned_sweeps_test
