// SPDX-License-Identifier: BSD-3-Clause
// What the tests of petsc and mumps share: the same problems, each with what that plugin promises.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "delassus/error.hpp"
#include "delassus/generate.hpp"
#include "delassus/solver.hpp"
#include "support/linear_problems.hpp"
#include "support/small_problems.hpp"

namespace delassus::tests {

/// A plugin chosen by name; the test is skipped where it was not built.
class PluginTest : public testing::Test {
protected:
    explicit PluginTest(std::string name, double tolerance) : name_(std::move(name)), tolerance_(tolerance) {}

    void SetUp() override {
        for (const auto& info : registry_.plugins())
            if (info.name == name_) return;
        GTEST_SKIP() << name_ << " was not built";
    }

    [[nodiscard]] Solver make(const OptionTexts& options = {}) const {
        return Solver(registry_.load(name_), options, &registry_);
    }
    [[nodiscard]] SolveSettings settings() const {
        SolveSettings result;
        result.tolerance = tolerance_;
        result.time_limit = 120.0;
        return result;
    }
    [[nodiscard]] SolveReport solve(const Problem& problem, Solution& solution, const OptionTexts& options = {}) const {
        const PreparedProblem prepared(problem);
        Solver solver = make(options);
        return solver.solve(prepared, solution, settings());
    }

    /// Solved, and x is that of a dense factorisation.
    void expect_reference(const Problem& problem, const OptionTexts& options = {}) const {
        Solution solution;
        const SolveReport report = solve(problem, solution, options);
        EXPECT_EQ(report.status, Status::Solved) << report.message;
        EXPECT_LE(report.error.natural, tolerance_);
        EXPECT_LE(report.error.balance, tolerance_);
        const Eigen::VectorXd reference = reference_velocity(problem);
        ASSERT_EQ(solution.x.size(), static_cast<std::size_t>(reference.size()));
        const Eigen::Map<const Eigen::VectorXd> x(solution.x.data(), reference.size());
        EXPECT_LE((x - reference).norm(), 100.0 * tolerance_ * (1.0 + reference.norm()));
    }

    void expect_solved(const Problem& problem, const OptionTexts& options = {}) const {
        Solution solution;
        const SolveReport report = solve(problem, solution, options);
        EXPECT_EQ(report.status, Status::Solved) << report.message;
        EXPECT_LE(report.error.natural, tolerance_);
        EXPECT_LE(report.error.balance, tolerance_);
    }

    void expect_every_structure(const OptionTexts& options = {}) const {
        expect_reference(tied_masses(), options);
        expect_reference(spring_row(12, 1.0, 40.0, 0.0, {2, 7}), options);
        expect_reference(spring_row(12, 0.0, 40.0, 0.0, {2, 7}), options);   // singular H, definite KKT
        expect_reference(spring_row(12, -0.5, 40.0, 0.0, {2, 7}), options);  // indefinite H
        expect_reference(spring_row(12, 1.0, 4.0, 1.5, {2, 7}), options);    // unsymmetric H
        expect_reference(spring_row(12, 1.0, 40.0, 0.0, {}), options);       // m = 0
        expect_reference(with_row_repeated(spring_row(12, 1.0, 40.0, 0.0, {2, 7})), options);
    }

    void expect_compliance_and_reduced() const {
        Problem soft = spring_row(6, 2.0, 0.0, 0.0, {1, 4});
        soft.E = SparseMatrix::from_triplets(2, 2, {{0, 0, 0.5}, {0, 1, 0.1}, {1, 0, 0.1}, {1, 1, 0.25}});
        expect_reference(soft);
        Problem reduced;
        reduced.E = soft.E;
        reduced.b = {1.0, -2.0};
        reduced.cones = {Cone::free(1), Cone::free(1)};
        Solution solution;
        const auto report = solve(reduced, solution);
        EXPECT_EQ(report.status, Status::Solved) << report.message;
        // 0.5 λ₀ + 0.1 λ₁ = −1, 0.1 λ₀ + 0.25 λ₁ = 2; determinant 0.115.
        EXPECT_NEAR(solution.lambda.at(0), -0.45 / 0.115, 1e-7);
        EXPECT_NEAR(solution.lambda.at(1), 1.1 / 0.115, 1e-7);
    }

    /// One symbolic analysis serves right-hand sides and values that change.
    void expect_reuse() const {
        Solver solver = make();
        std::int64_t factorizations = 0;
        for (int k = 0; k < 100; ++k) {
            ChainParameters chain;
            chain.bodies = 20;
            chain.mass = 1.0 + 0.1 * (k / 10);
            PreparedProblem prepared(generate_chain(chain));
            Problem changed = prepared.problem();
            changed.a[0] += k;
            prepared.set_right_hand_side(changed.a, changed.b);
            Solution solution;
            const auto report = solver.solve(prepared, solution, settings());
            EXPECT_EQ(report.status, Status::Solved) << report.message;
            EXPECT_EQ(report.analyses, 1) << "solve " << k;
            EXPECT_GE(report.factorizations, factorizations);
            factorizations = report.factorizations;
        }
        EXPECT_LE(factorizations, 100);
        EXPECT_GE(factorizations, 10);
    }

    void expect_two_instances() const {
        const PreparedProblem first(spring_row(30, 1.0, 5.0, 0.0, {3, 20})), second(tied_masses());
        Solver one = make(), two = make();
        for (int round = 0; round < 3; ++round) {
            Solution a, b;
            EXPECT_EQ(one.solve(first, a, settings()).status, Status::Solved);
            EXPECT_EQ(two.solve(second, b, settings()).status, Status::Solved);
            EXPECT_NEAR(a.x.at(3), 0.1, 1e-7);
            EXPECT_NEAR(b.x.at(0), 1.0, 1e-7);
        }
    }

    void expect_silence() const {
        std::fflush(stdout);
        testing::internal::CaptureStdout();
        expect_every_structure();
        std::fflush(stdout);
        EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    }

    void expect_no_false_claim_on_contradiction() const {
        Solution solution;
        const auto report = solve(with_row_repeated(spring_row(12, 1.0, 40.0, 0.0, {2, 7}), 0.3), solution);
        EXPECT_TRUE(report.status == Status::Infeasible || report.status == Status::Stalled)
            << name_of(report.status) << " " << report.message;
        EXPECT_GT(report.error.natural, 1e-3);
    }

    void expect_zero_iterations_return_the_start() const {
        auto none = settings();
        none.max_iterations = 0;
        none.warm_start = true;
        const PreparedProblem prepared(tied_masses());
        Solver solver = make();
        Solution start{{0.5, 0.25}, {2.0}};
        EXPECT_EQ(solver.solve(prepared, start, none).status, Status::IterationLimit);
        EXPECT_EQ(start.x, (std::vector<double>{0.5, 0.25}));
        Solution answer{{1.0, 1.0}, {-3.0}};
        EXPECT_EQ(solver.solve(prepared, answer, none).status, Status::Solved);
    }

    void expect_cancel() const {
        auto cancelling = settings();
        cancelling.cancelled = [] { return true; };
        const PreparedProblem prepared(tied_masses());
        Solver solver = make();
        Solution solution;
        EXPECT_EQ(solver.solve(prepared, solution, cancelling).status, Status::Cancelled);
        EXPECT_EQ(solver.solve(prepared, solution, settings()).status, Status::Solved);
    }

    [[nodiscard]] static Problem chain(std::int32_t bodies, double mass_ratio, bool heavy_end, std::int32_t repeated) {
        ChainParameters parameters;
        parameters.bodies = bodies;
        parameters.mass_ratio = mass_ratio;
        parameters.heavy_end = heavy_end;
        parameters.repeated = repeated;
        parameters.world_frame = true;
        return generate_chain(parameters);
    }

    Registry registry_;
    std::string name_;
    double tolerance_;
};

}  // namespace delassus::tests
