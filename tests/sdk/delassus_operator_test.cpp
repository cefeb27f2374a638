// SPDX-License-Identifier: BSD-3-Clause
// The Delassus operator against dense linear algebra, for every structure of H.
#include "delassus/sdk/delassus_operator.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "delassus/needs.hpp"

namespace delassus::delassus_operator_test {
namespace {

using Dense = Eigen::MatrixXd;

Problem random_problem(std::mt19937_64& random, int bodies, int width, int coupling) {
    std::normal_distribution<double> normal;
    const int n = bodies * width;
    Dense root = Dense::Zero(n, n);
    for (int k = 0; k < bodies; ++k)
        for (int i = 0; i < width; ++i)
            for (int j = 0; j < width; ++j) root(k * width + i, k * width + j) = normal(random) + (i == j ? 12.0 : 0.0);
    for (int k = 0; coupling > 0 && k + coupling < n; k += 1) root(k + coupling, k) += 0.5;
    const Dense H = root * root.transpose();
    Problem problem;
    std::vector<Triplet> triplets;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            if (H(i, j) != 0.0) triplets.push_back({i, j, 0.5 * (H(i, j) + H(j, i))});
    problem.H = SparseMatrix::from_triplets(n, n, triplets);
    const int contacts = bodies + 2;
    std::vector<Triplet> rows;
    for (int c = 0; c < contacts; ++c) {
        problem.cones.push_back(Cone::friction(0.5));
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 5; ++k)
                rows.push_back(
                    {3 * c + i, static_cast<std::int32_t>(random() % static_cast<std::uint64_t>(n)), normal(random)});
    }
    problem.D = SparseMatrix::from_triplets(3 * contacts, n, rows);
    problem.a.assign(static_cast<std::size_t>(n), 0.0);
    problem.b.assign(static_cast<std::size_t>(3 * contacts), 0.0);
    for (double& value : problem.a) value = normal(random);
    for (double& value : problem.b) value = normal(random);
    return problem;
}

struct Case {
    const char* name;
    int width, coupling;
    bool compliant;
    Structure expected;
};

class OperatorOfStructure : public ::testing::TestWithParam<Case> {};

TEST_P(OperatorOfStructure, AgreesWithDenseAlgebra) {
    std::mt19937_64 random(3);
    Problem data = random_problem(random, 20, GetParam().width, GetParam().coupling);
    if (GetParam().compliant) {
        std::vector<Triplet> triplets;
        for (std::int32_t i = 0; i < data.m(); ++i) triplets.push_back({i, i, 0.1 + 0.01 * i});
        triplets.push_back({0, 4, 0.02});
        triplets.push_back({4, 0, 0.02});
        data.E = SparseMatrix::from_triplets(data.m(), data.m(), triplets);
    }
    const PreparedProblem prepared(data);
    ASSERT_EQ(prepared.structure(), GetParam().expected);
    const sdk::ProblemView view(prepared.raw());
    sdk::DelassusOperator op;
    op.analyze(view);
    op.factorize(view);

    const Dense H = view.H, D = view.D, E = view.E;
    const Dense N = D * H.ldlt().solve(D.transpose()) + E;
    const double scale = N.norm();

    sdk::Vector lambda = sdk::Vector::LinSpaced(view.m, -1.0, 2.0), product(view.m);
    op.apply(view, lambda, product);
    EXPECT_LT((product - N * lambda).norm(), 1e-12 * scale * lambda.norm());
    EXPECT_LT((op.diagonal() - N.diagonal()).norm(), 1e-12 * scale);
    EXPECT_LT((Dense(op.formed(view)) - N).norm(), 1e-12 * scale);
    // N and its blocks made in one pass are the same, and so are they after another one without.
    for (const bool will_form : {true, false}) {
        op.factorize(view, will_form);
        EXPECT_LT((op.diagonal() - N.diagonal()).norm(), 1e-12 * scale);
        EXPECT_LT((Dense(op.formed(view)) - N).norm(), 1e-12 * scale);
    }
    for (std::size_t c = 0; c < view.cones.size(); ++c) {
        ASSERT_NE(op.block(c), nullptr);
        const Eigen::Map<const Eigen::Matrix3d> block(op.block(c));
        EXPECT_LT((block - N.block<3, 3>(view.cones[c].first_row, view.cones[c].first_row)).norm(), 1e-12 * scale);
    }
    const sdk::Vector r = D * H.ldlt().solve(sdk::Vector(view.a)) + view.b;
    EXPECT_LT((op.free_velocity(view) - r).norm(), 1e-12 * (1.0 + r.norm()));
    const sdk::Vector x = H.ldlt().solve(view.a + D.transpose() * lambda);
    EXPECT_LT((op.velocity(view, lambda) - x).norm(), 1e-12 * (1.0 + x.norm()));
}

TEST(DelassusOperator, KeepsTheAnalysisOfHWhateverBecomesOfD) {
    std::mt19937_64 random(3);
    Problem data = random_problem(random, 20, 3, 4);
    sdk::DelassusOperator op;
    for (int step = 0; step < 3; ++step) {
        // A row fewer each time, and other values of H in the same places.
        --data.D.rows;
        data.D.row_start.pop_back();
        data.D.column.resize(static_cast<std::size_t>(data.D.row_start.back()));
        data.D.value.resize(data.D.column.size());
        data.b.pop_back();
        data.cones.assign(static_cast<std::size_t>(data.D.rows), Cone::nonnegative(1));
        for (double& value : data.H.value) value *= 1.5;
        const PreparedProblem prepared(data);
        const sdk::ProblemView view(prepared.raw());
        op.analyze(view);
        op.factorize(view);
        EXPECT_EQ(op.inverse().analyses(), 1);
        EXPECT_EQ(op.inverse().factorizations(), step + 1);
        const Dense H = view.H, D = view.D;
        const Dense N = D * H.ldlt().solve(D.transpose());
        EXPECT_LT((Dense(op.formed(view)) - N).norm(), 1e-12 * N.norm());
    }
    // Another pattern of H is analysed anew.
    data = random_problem(random, 20, 3, 5);
    const PreparedProblem prepared(data);
    op.analyze(sdk::ProblemView(prepared.raw()));
    EXPECT_EQ(op.inverse().analyses(), 2);
}

INSTANTIATE_TEST_SUITE_P(Structures, OperatorOfStructure,
                         ::testing::Values(Case{"diagonal", 1, 0, false, Structure::Diagonal},
                                           Case{"blocks", 6, 0, false, Structure::Blocks},
                                           Case{"sparse", 3, 4, false, Structure::Definite},
                                           Case{"diagonal_E", 1, 0, true, Structure::Diagonal},
                                           Case{"blocks_E", 3, 0, true, Structure::Blocks},
                                           Case{"sparse_E", 3, 4, true, Structure::Definite}),
                         [](const auto& parameters) { return parameters.param.name; });

}  // namespace
}  // namespace delassus::delassus_operator_test
