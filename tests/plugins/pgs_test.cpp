// SPDX-License-Identifier: BSD-3-Clause
// pgs: exact one-contact problems against the natural map and brute force, velocity sweeps against row sweeps, every
// variant on problems with known answers, warm start, equality of the problem's forms, the shared contact problems.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "../../plugins/pgs/model.hpp"
#include "delassus/error.hpp"
#include "delassus/errors.hpp"
#include "delassus/generate.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/sdk/residual.hpp"
#include "delassus/solver.hpp"
#include "support/places.hpp"
#include "support/small_problems.hpp"
#include "support/solving.hpp"

namespace delassus::pgs_test {
namespace {

using tests::diagonal_matrix;
using tests::identity;
using tests::infinity;
using tests::one_row;
using tests::point_on_plane;
using tests::to;

// ---- One-contact problems ------------------------------------------------------------------------------------------

/// Random N, q and μ: N = A Aᵀ with one column of A scaled by `thin` (0: singular, and q in the range of A).
struct RandomContact {
    Eigen::MatrixXd N;
    Eigen::VectorXd q;
    double mu = 0.0;

    RandomContact(std::mt19937& random, int rows, double thin) {
        std::normal_distribution<double> normal;
        const auto draw = [&] { return normal(random); };
        Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(rows, rows, draw);
        A.col(rows - 1) *= thin;
        N = A * A.transpose();
        q = Eigen::VectorXd::NullaryExpr(rows, draw);
        if (thin == 0.0) q = (A * q).eval();
        mu = random() % 8 == 0 ? 0.0 : std::pow(10.0, std::uniform_real_distribution<double>(-3.0, 1.0)(random));
    }

    [[nodiscard]] Eigen::VectorXd solve(bool coulomb, double& kappa) const {
        const pgs::ContactMatrix matrix(static_cast<int>(q.size()), N.data());
        Eigen::VectorXd lambda = Eigen::VectorXd::Zero(q.size());
        if (coulomb) {
            pgs::solve_coulomb(matrix, mu, q.data(), kappa, lambda.data());
        } else {
            pgs::solve_associated(matrix, mu, q.data(), kappa, lambda.data());
        }
        return lambda;
    }

    /// ‖λ − P(λ − s²u)‖ / (‖λ‖ + s²‖q‖), zero exactly at a solution.
    [[nodiscard]] double natural(bool coulomb, const Eigen::VectorXd& lambda) const {
        const double s2 = static_cast<double>(q.size()) / N.trace();
        const Eigen::VectorXd u = N * lambda + q;
        const delassus_cone cone{
            DELASSUS_CONE_FRICTION, 0, static_cast<std::int32_t>(q.size()), 1, &mu, nullptr, nullptr};
        Eigen::VectorXd trial = lambda - s2 * u;
        if (coulomb) trial[0] -= s2 * sdk::FrictionCone::de_saxce(cone, u.data());
        sdk::FrictionCone::project(cone, trial.data());
        return (lambda - trial).norm() / (lambda.norm() + s2 * q.norm());
    }
};

class OneContact : public testing::TestWithParam<std::tuple<int, bool, double>> {};

TEST_P(OneContact, SolvesTheNaturalMap) {
    const auto [rows, coulomb, thin] = GetParam();
    std::mt19937 random(7);
    int opened = 0, stuck = 0, slid = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        const RandomContact contact(random, rows, thin);
        double kappa = 0.0;
        const Eigen::VectorXd lambda = contact.solve(coulomb, kappa);
        ASSERT_LE(contact.natural(coulomb, lambda), 1e-12) << "trial " << trial << ", mu " << contact.mu << "\nN\n"
                                                           << contact.N << "\nq\n"
                                                           << contact.q;
        const double tangent = lambda.tail(rows - 1).norm();
        if (lambda[0] == 0.0) {
            ++opened;
        } else if (tangent < contact.mu * lambda[0] * (1.0 - 1e-9)) {
            ++stuck;
        } else {
            ++slid;
        }
        // A guess changes the way, not the answer.
        kappa *= 3.0;
        EXPECT_LE(contact.natural(coulomb, contact.solve(coulomb, kappa)), 1e-12);
    }
    EXPECT_GT(opened, 500);
    EXPECT_GT(stuck, 500);
    EXPECT_GT(slid, 500);
}

INSTANTIATE_TEST_SUITE_P(RandomMatrices, OneContact,
                         testing::Combine(testing::Values(2, 3), testing::Bool(),
                                          testing::Values(1.0, 1e-4, 1e-8, 0.0)));

TEST(OneContactBruteForce, NoPointOfTheConeIsLower) {
    std::mt19937 random(11);
    for (int trial = 0; trial < 50; ++trial) {
        const RandomContact contact(random, 3, 1.0);
        double kappa = 0.0;
        const Eigen::VectorXd lambda = contact.solve(false, kappa);
        const auto objective = [&](const Eigen::VectorXd& y) { return 0.5 * y.dot(contact.N * y) + contact.q.dot(y); };
        const double value = objective(lambda);
        // Every ray of the cone on a grid, at its own best length.
        double best = 0.0;
        for (int i = 0; i <= 60; ++i) {
            for (int k = 0; k < 240; ++k) {
                const double radius = contact.mu * i / 60.0, angle = 2.0 * M_PI * k / 240.0;
                const Eigen::Vector3d ray(1.0, radius * std::cos(angle), radius * std::sin(angle));
                best = std::min(best, objective(std::max(0.0, -contact.q.dot(ray) / ray.dot(contact.N * ray)) * ray));
            }
        }
        EXPECT_LE(value, best + 1e-12 * std::abs(best));
        EXPECT_GE(value, best - 0.05 * std::abs(best)) << "the grid comes near the minimum";
    }
}

// ---- Sweeps --------------------------------------------------------------------------------------------------------

Problem pile() {
    SpherePileParameters parameters;
    parameters.contacts = 200;
    parameters.speed = 0.5;
    return generate_sphere_pile(parameters);
}

/// Sweeps both forms of one problem side by side.
void compare_forms(Problem problem, pgs::Local local) {
    const PreparedProblem prepared(std::move(problem));
    const sdk::ProblemView view(prepared.raw());
    ASSERT_TRUE(pgs::can_sweep_on_velocities(view));
    sdk::DelassusOperator N;
    N.analyze(view);
    N.factorize(view);
    pgs::Model models[2];
    sdk::Vector lambda[2];
    pgs::SweepState state[2];
    for (int form = 0; form < 2; ++form) {
        models[form].build(view, N, form == 0, false, true, pgs::Ordering::Given);
        models[form].set_right_hand_side(view, N, sdk::block_scaling(view.cones, N.diagonal()));
        models[form].state_of(sdk::Vector::Zero(view.m), state[form]);
    }
    pgs::SweepRule rule;
    rule.local = local;
    rule.coulomb = view.coulomb;
    rule.omega = 1.2;
    for (int k = 0; k < 30; ++k) {
        rule.direction = k % 3 == 2 ? pgs::Direction::Backward : pgs::Direction::Forward;
        for (int form = 0; form < 2; ++form) {
            models[form].sweep_in_place(rule, state[form]);
            models[form].reactions(state[form], lambda[form]);
        }
        ASSERT_GT(lambda[0].norm(), 0.0);
        ASSERT_LE((lambda[0] - lambda[1]).norm(), 1e-10 * lambda[0].norm()) << "sweep " << k;
    }
}

TEST(PgsSweep, OnVelocitiesEqualsOnRowsOfN) {
    for (const Law law : {Law::Associated, Law::Coulomb}) {
        for (const auto local : {pgs::Local::Diagonal, pgs::Local::Exact}) {
            Problem problem = pile();
            problem.law = law;
            compare_forms(problem, local);
        }
    }
}

TEST(PgsSweep, TakesADiagonalComplianceIntoTheVelocities) {
    Problem problem = pile();
    std::vector<double> compliance(problem.b.size());
    for (std::size_t i = 0; i < compliance.size(); ++i) compliance[i] = 0.01 * static_cast<double>(i % 5);
    problem.E = diagonal_matrix(compliance);
    compare_forms(problem, pgs::Local::Diagonal);
}

TEST(PgsSweep, JacobiBlocksBoundN) {
    const PreparedProblem prepared(pile());
    const sdk::ProblemView view(prepared.raw());
    sdk::DelassusOperator N;
    N.analyze(view);
    N.factorize(view);
    const Eigen::MatrixXd dense = N.formed(view);
    for (const bool on_velocities : {true, false}) {
        pgs::Model model;
        model.build(view, N, on_velocities, true, true, pgs::Ordering::Given);
        Eigen::MatrixXd difference = -dense;
        for (std::size_t k = 0; k < model.blocks().size(); ++k) {
            const auto& block = model.blocks()[k].rows;
            const auto& M = model.local().contact[static_cast<std::size_t>(model.local().block[k].matrix)];
            Eigen::Matrix3d full;
            full << M.nn, M.nt[0], M.nt[1], M.nt[0], M.tt[0], M.tt[1], M.nt[1], M.tt[1], M.tt[2];
            difference.block<3, 3>(block.first, block.first) += full;
            EXPECT_LE(full.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff() * model.local().block[k].step,
                      1.0 + 1e-9);
        }
        const double least = difference.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff();
        EXPECT_GE(least, -1e-9 * dense.norm()) << (on_velocities ? "on velocities" : "on rows of N");
    }
}

/// All kinds of cones, one row of each body to a row of the problem where `apart`.
Problem all_kinds(bool apart) {
    Problem problem;
    problem.cones = {Cone::friction(0.4), Cone::nonnegative(2),   Cone::box({-1.0, 0.0}, {0.5, 2.0}),
                     Cone::free(2),       Cone::friction(0.7, 2), Cone::free(8)};
    std::int32_t m = 0;
    for (const Cone& cone : problem.cones) m += cone.rows;
    std::mt19937 random(3);
    const auto draw = [&] { return std::normal_distribution<double>()(random); };
    std::vector<Triplet> entries;
    std::vector<double> masses;
    for (std::int32_t i = 0; i < m; ++i) {
        masses.push_back(1.0 + 0.1 * i);
        problem.a.push_back(draw());
        problem.b.push_back(draw());
        for (std::int32_t j = 0; j < m; ++j)
            if (i == j || !apart) entries.push_back({i, j, draw()});
    }
    problem.H = diagonal_matrix(masses);
    problem.D = SparseMatrix::from_triplets(m, m, entries);
    return problem;
}

TEST(PgsSweep, ALookSeesTheNaturalError) {
    for (const Law law : {Law::Associated, Law::Coulomb})
        for (const bool apart : {true, false})
            for (const bool on_velocities : {true, false}) {
                Problem problem = all_kinds(apart);
                problem.law = law;
                const PreparedProblem prepared(std::move(problem));
                const sdk::ProblemView view(prepared.raw());
                sdk::DelassusOperator N;
                N.analyze(view);
                N.factorize(view);
                const sdk::NaturalResidual residual(view, N.diagonal(), N.free_velocity(view));
                pgs::Model model;
                model.build(view, N, on_velocities, false, false, pgs::Ordering::Spaced);
                model.set_right_hand_side(view, N, residual.scaling());
                pgs::SweepState state;
                sdk::Vector lambda = sdk::Vector::LinSpaced(view.m, -1.0, 2.0);
                model.state_of(lambda, state);
                pgs::SweepRule rule;
                rule.local = pgs::Local::Diagonal;
                rule.coulomb = view.coulomb;
                const auto natural = [&] {
                    model.reactions(state, lambda);
                    const sdk::Vector u = view.D * N.velocity(view, lambda) + view.b;
                    return residual.natural(lambda, u);
                };
                const auto looked = [&] { return std::sqrt(model.look(state, view.coulomb)) / residual.reference(); };
                double before = natural();
                EXPECT_NEAR(looked(), before, 1e-12 * before);
                // What a sweep records is the error at the moment of each visit: blocks apart are as they were.
                const double recorded = std::sqrt(model.recorded_sweep(rule, state)) / residual.reference();
                if (apart) {
                    EXPECT_NEAR(recorded, before, 1e-12 * before);
                }
                before = natural();
                EXPECT_NEAR(looked(), before, 1e-12 * before);
            }
}

// ---- The plugin ----------------------------------------------------------------------------------------------------

using Result = tests::Solved;

Result solve(const Problem& problem, const OptionTexts& options, const SolveSettings& settings, Solution start = {}) {
    return tests::solve_with("pgs", problem, settings, options, std::move(start));
}

using Choice = std::tuple<std::string, std::string, std::string>;  // variant, local solver, form

class Variant : public testing::TestWithParam<Choice> {
protected:
    [[nodiscard]] OptionTexts options() const {
        const auto& [variant, local, form] = GetParam();
        return {{"variant", variant}, {"local_solver", local}, {"form", form}, {"omega", "1"}};
    }

    void expect_answer(const Problem& problem, const std::vector<double>& x, const std::vector<double>& lambda) const {
        tests::expect_solution(solve(problem, options(), to(1e-11)), x, lambda);
    }
};

TEST_P(Variant, KnowsFreeNonnegativeAndBoxRows) {
    expect_answer(tests::tied_masses(), {1.0, 1.0}, {-3.0});
    expect_answer(one_row(2.0, -6.0, Cone::nonnegative(1)), {0.0}, {6.0});
    expect_answer(one_row(2.0, 6.0, Cone::nonnegative(1)), {3.0}, {0.0});
    expect_answer(one_row(2.0, 5.0, Cone::box({-1.0}, {2.0})), {2.0}, {-1.0});
    expect_answer(one_row(2.0, -5.0, Cone::box({-1.0}, {2.0})), {-1.5}, {2.0});
    expect_answer(one_row(2.0, -5.0, Cone::box({-infinity}, {infinity})), {0.0}, {5.0});
}

TEST_P(Variant, SticksAndSlides) {
    for (const Law law : {Law::Associated, Law::Coulomb}) {
        expect_answer(point_on_plane(2.0, 10.0, 3.0, 0.5, law), {0.0, 0.0, 0.0}, {10.0, -3.0, 0.0});
        expect_answer(point_on_plane(2.0, -4.0, 1.0, 0.5, law), {2.0, 0.5, 0.0}, {0.0, 0.0, 0.0});
    }
    expect_answer(point_on_plane(2.0, 10.0, 8.0, 0.5, Law::Coulomb), {0.0, 1.5, 0.0}, {10.0, -5.0, 0.0});
    // Associated: λ is the projection of −a = (10, −8, 0) onto the cone: λ_n = (10 + 0.5 · 8)/1.25 = 11.2.
    expect_answer(point_on_plane(2.0, 10.0, 8.0, 0.5, Law::Associated), {0.6, 1.2, 0.0}, {11.2, -5.6, 0.0});
}

TEST_P(Variant, ReachesTheVelocitiesOfAPile) {
    for (const Law law : {Law::Associated, Law::Coulomb}) {
        Problem problem = pile();
        problem.law = law;
        const auto [solution, report] = solve(problem, options(), to(1e-9));
        EXPECT_EQ(report.status, Status::Solved) << report.message;
        EXPECT_LE(report.error.natural, 1e-9);
        EXPECT_LE(report.error.balance, 1e-12);
        if (law == Law::Coulomb) continue;
        // The velocities of the convex problem are unique.
        const auto other = solve(problem, {}, to(1e-9));
        const PreparedProblem prepared(problem);
        EXPECT_LE(ErrorMeter(prepared).velocity(solution.x, other.solution.x), 1e-6);
    }
}

INSTANTIATE_TEST_SUITE_P(All, Variant,
                         testing::Combine(testing::Values("forward", "symmetric", "jacobi"),
                                          testing::Values("diagonal", "exact"),
                                          testing::Values("velocities", "operator")),
                         [](const auto& parameters) {
                             return std::get<0>(parameters.param) + "_" + std::get<1>(parameters.param) + "_" +
                                    std::get<2>(parameters.param);
                         });

TEST(Pgs, TakesPlanarFrictionInBothLaws) {
    for (const char* local : {"diagonal", "exact"}) {
        for (const Law law : {Law::Associated, Law::Coulomb}) {
            Problem problem;
            problem.H = diagonal_matrix({2.0, 2.0});
            problem.D = identity(2);
            problem.a = {-10.0, 8.0};
            problem.b = {0.0, 0.0};
            problem.cones = {Cone::friction(0.5, 2)};
            problem.law = law;
            const auto [solution, report] = solve(problem, {{"local_solver", local}}, to(1e-11));
            EXPECT_EQ(report.status, Status::Solved);
            EXPECT_NEAR(solution.lambda[0], law == Law::Coulomb ? 10.0 : 11.2, 1e-9);
            EXPECT_NEAR(solution.lambda[1], law == Law::Coulomb ? -5.0 : -5.6, 1e-9);
        }
    }
}

TEST(Pgs, SolvesRepeatedFreeRowsInBlocksOfAnySize) {
    // Five masses, each row written twice: as one block of ten rows (swept one by one), as five of two, as two of five.
    for (const std::vector<std::int32_t>& sizes : {std::vector<std::int32_t>{10}, {2, 2, 2, 2, 2}, {5, 5}}) {
        Problem problem;
        problem.H = diagonal_matrix({1.0, 2.0, 3.0, 4.0, 5.0});
        std::vector<Triplet> triplets;
        for (std::int32_t i = 0; i < 10; ++i) {
            triplets.push_back({i, i / 2, 1.0});
            if (i / 2 > 0) triplets.push_back({i, i / 2 - 1, -0.5});
        }
        problem.D = SparseMatrix::from_triplets(10, 5, triplets);
        problem.a = {1.0, -2.0, 3.0, -4.0, 5.0};
        problem.b = {0.5, 0.5, 0.25, 0.25, 0.0, 0.0, -1.0, -1.0, 2.0, 2.0};
        for (const auto size : sizes) problem.cones.push_back(Cone::free(size));
        const auto [solution, report] = solve(problem, {}, to(1e-11));
        EXPECT_EQ(report.status, Status::Solved) << report.message;
        double previous = 0.0;
        for (std::size_t i = 0; i < 5; ++i) {
            previous = 0.5 * previous - problem.b[2 * i];
            EXPECT_NEAR(solution.x[i], previous, 1e-9);
        }
    }
}

TEST(Pgs, LeavesARowThatNothingMovesAtItsBound) {
    Problem problem;
    problem.H = diagonal_matrix({1.0});
    problem.D = SparseMatrix::from_triplets(3, 1, {{2, 0, 1.0}});
    problem.a = {-1.0};
    problem.b = {1.0, -1.0, 0.0};
    problem.cones = {Cone::box({-2.0}, {3.0}), Cone::box({-2.0}, {3.0}), Cone::nonnegative(1)};
    const auto [solution, report] = solve(problem, {}, to(1e-10));
    EXPECT_EQ(report.status, Status::Solved) << report.message;
    EXPECT_EQ(solution.lambda[0], -2.0);
    EXPECT_EQ(solution.lambda[1], 3.0);
    EXPECT_NEAR(solution.lambda[2], 1.0, 1e-10);
}

TEST(Pgs, AnswersTheReducedFormAsTheFullOne) {
    const Problem full = pile();
    const PreparedProblem prepared(full);
    const sdk::ProblemView view(prepared.raw());
    sdk::DelassusOperator N;
    N.analyze(view);
    N.factorize(view);
    const sdk::SparseRows formed = N.formed(view);
    const sdk::Vector r = N.free_velocity(view);

    Problem reduced;
    reduced.cones = full.cones;
    reduced.law = full.law;
    reduced.D = SparseMatrix::zero(full.m(), 0);
    reduced.b.assign(r.data(), r.data() + r.size());
    std::vector<Triplet> triplets;
    for (std::int32_t i = 0; i < full.m(); ++i)
        for (sdk::SparseRows::InnerIterator entry(formed, i); entry; ++entry)
            triplets.push_back({i, static_cast<std::int32_t>(entry.col()), entry.value()});
    reduced.E = SparseMatrix::from_triplets(full.m(), full.m(), triplets);

    const auto a = solve(full, {}, to(1e-9)), b = solve(reduced, {}, to(1e-9));
    EXPECT_EQ(a.report.status, Status::Solved);
    EXPECT_EQ(b.report.status, Status::Solved);
    std::vector<double> x;
    ErrorMeter(prepared).velocity_of(b.solution.lambda, x);
    EXPECT_LE(ErrorMeter(prepared).velocity(x, a.solution.x), 1e-6);
}

TEST(Pgs, TakesASparseHAndAFullE) {
    ElasticBlockParameters parameters;
    const Problem elastic = generate_elastic_block(parameters);
    for (const Law law : {Law::Associated, Law::Coulomb}) {
        Problem problem = elastic;
        problem.law = law;
        EXPECT_EQ(solve(problem, {}, to(1e-6)).report.status, Status::Solved);
    }
    Problem coupled = pile();
    std::vector<Triplet> triplets;
    for (std::int32_t i = 0; i < coupled.m(); ++i) {
        triplets.push_back({i, i, 0.2});
        if (i > 0) triplets.push_back({i, i - 1, 0.05});
        if (i + 1 < coupled.m()) triplets.push_back({i, i + 1, 0.05});
    }
    coupled.E = SparseMatrix::from_triplets(coupled.m(), coupled.m(), triplets);
    const auto [solution, report] = solve(coupled, {}, to(1e-9));
    EXPECT_EQ(report.status, Status::Solved);
    EXPECT_LE(report.error.natural, 1e-9);
}

TEST(Pgs, StartsFromAGivenAnswer) {
    const Problem problem = pile();
    const auto cold = solve(problem, {}, to(1e-6));
    ASSERT_GT(cold.report.iterations, 10);
    SolveSettings settings = to(1e-6);
    settings.warm_start = true;
    EXPECT_EQ(solve(problem, {}, settings, cold.solution).report.iterations, 0);
    settings.tolerance = 1e-8;
    const auto warm = solve(problem, {}, settings, cold.solution);
    EXPECT_EQ(warm.report.status, Status::Solved);
    EXPECT_LT(warm.report.iterations, solve(problem, {}, to(1e-8)).report.iterations);
}

TEST(Pgs, StopsWhereItIsTold) {
    SolveSettings settings = to(1e-12);
    settings.max_iterations = 0;
    const auto none = solve(pile(), {}, settings);
    EXPECT_EQ(none.report.status, Status::IterationLimit);
    EXPECT_EQ(none.report.iterations, 0);
    settings.max_iterations = 7;
    EXPECT_EQ(solve(pile(), {}, settings).report.iterations, 7);
    settings.max_iterations = 100000000;
    settings.time_limit = 0.05;
    // No reaction can stop this row: the error stays.
    Problem impossible = one_row(1.0, 0.0, Cone::nonnegative(1));
    impossible.D = SparseMatrix::zero(1, 1);
    impossible.b = {-1.0};
    const auto report = solve(impossible, {{"stall_window", "0"}}, settings).report;
    EXPECT_EQ(report.status, Status::TimeLimit);
    EXPECT_LT(report.seconds_solve, 5.0);
    settings.time_limit = infinity;
    EXPECT_EQ(solve(impossible, {{"stall_window", "1000"}}, settings).report.status, Status::Stalled);
}

TEST(Pgs, AccelerationSavesSweeps) {
    for (const Law law : {Law::Associated, Law::Coulomb})
        for (const bool on_velocities : {true, false}) {
            SpherePileParameters parameters;
            parameters.contacts = 300;
            parameters.speed = 0.5;
            Problem problem = generate_sphere_pile(parameters);
            problem.law = law;
            const std::string form = on_velocities ? "velocities" : "operator";
            const auto plain = solve(problem, {{"form", form}, {"acceleration", "none"}}, to(1e-9));
            const auto extrapolated = solve(problem, {{"form", form}, {"acceleration", "anderson"}}, to(1e-9));
            ASSERT_EQ(plain.report.status, Status::Solved);
            ASSERT_EQ(extrapolated.report.status, Status::Solved);
            EXPECT_LT(extrapolated.report.iterations, 0.6 * static_cast<double>(plain.report.iterations));
            EXPECT_LE(extrapolated.report.error.natural, 1e-9);
        }
}

TEST(Pgs, SolvesInEveryOrder) {
    for (const char* ordering : {"given", "spaced", "coloured"})
        for (const Law law : {Law::Associated, Law::Coulomb}) {
            Problem problem = pile();
            problem.law = law;
            const auto report = solve(problem, {{"ordering", ordering}}, to(1e-9)).report;
            EXPECT_EQ(report.status, Status::Solved) << ordering;
            EXPECT_LE(report.error.natural, 1e-9) << ordering;
        }
}

TEST(Pgs, RefusesAFormThatTheProblemDoesNotHave) {
    Problem problem = one_row(2.0, -6.0, Cone::nonnegative(1));
    problem.E = SparseMatrix::from_triplets(1, 1, {{0, 0, 1.0}});
    EXPECT_EQ(solve(problem, {{"form", "velocities"}}, to(1e-10)).report.status, Status::Solved);
    Problem reduced;
    reduced.D = SparseMatrix::zero(1, 0);
    reduced.E = problem.E;
    reduced.b = {-1.0};
    reduced.cones = problem.cones;
    EXPECT_THROW((void)solve(reduced, {{"form", "velocities"}}, to(1e-10)), Unsupported);
}

// ---- The shared contact problems -----------------------------------------------------------------------------------

std::filesystem::path shared_problems() {
    const char* chosen = std::getenv("DELASSUS_SHARED_PROBLEMS");
    return chosen != nullptr ? chosen : tests::places::shared_problems;
}

TEST(PgsShared, ReachesFourDigitsInBothLaws) {
    if (!std::filesystem::exists(shared_problems())) GTEST_SKIP() << "no folder " << shared_problems();
    int solved = 0;
    for (const auto& entry : std::filesystem::directory_iterator(shared_problems())) {
        if (!std::filesystem::exists(entry.path() / "problem.json")) continue;
        const std::string name = entry.path().filename().string();
        if (name.starts_with("heavytop") || name.starts_with("spheres-in-a-box")) continue;
        for (const Law law : {Law::Associated, Law::Coulomb}) {
            Problem problem = read_problem(entry.path());
            problem.law = law;
            SolveSettings settings = to(1e-4);
            settings.max_iterations = 100000000;
            settings.time_limit = 60.0;
            const auto report = solve(problem, {}, settings).report;
            EXPECT_EQ(report.status, Status::Solved) << name << ", " << name_of(law) << ": " << report.error.natural;
            EXPECT_LE(report.error.natural, 1e-4) << name;
            ++solved;
        }
    }
    EXPECT_GT(solved, 0);
}

}  // namespace
}  // namespace delassus::pgs_test
