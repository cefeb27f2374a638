// SPDX-License-Identifier: BSD-3-Clause
// A solver that the program itself brings, without a shared library.
#include <gtest/gtest.h>

#include <string>

#include "delassus/error.hpp"
#include "delassus/registry.hpp"
#include "delassus/sdk/solver.hpp"
#include "delassus/solver_config.hpp"

namespace delassus::tests::own_plugin_test {
namespace {

/// x = H⁻¹(a + Dᵀλ) with one row D = d: λ = −(b + d·H⁻¹a)/(d·H⁻¹d), for a diagonal H; times `factor`.
class OneRow : public sdk::Solver {
public:
    explicit OneRow(const sdk::OptionValues& options) : factor_(options.real("factor")) {}
    void analyze(const sdk::ProblemView&) override {}
    void factorize(const sdk::ProblemView&) override {}
    sdk::Outcome solve(const sdk::ProblemView& problem, const sdk::Request&, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override {
        const sdk::Vector inverse = Eigen::MatrixXd(problem.H).diagonal().cwiseInverse();
        const sdk::Vector d = Eigen::MatrixXd(problem.D).row(0).transpose();
        lambda[0] = -factor_ * (problem.b[0] + d.dot(inverse.cwiseProduct(problem.a))) / d.dot(inverse.cwiseProduct(d));
        x = inverse.cwiseProduct(problem.a + d * lambda[0]);
        return {.status = DELASSUS_SOLVED, .iterations = 1, .residual = 0.0, .message = {}};
    }

private:
    double factor_;
};

std::shared_ptr<const Plugin> one_row() {
    static constexpr delassus_option options[] = {sdk::real_option("factor", "1", 0, 10, "", "of the reaction")};
    static const sdk::PluginInfo info{.name = "one_row",
                                      .version = "1",
                                      .description = "one row",
                                      .licence = "BSD-3-Clause",
                                      .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_H_DIAGONAL};
    return Plugin::of(sdk::Border<OneRow>::descriptor(info, options));
}

Problem one_row_problem() {
    Problem problem;
    problem.H = SparseMatrix::from_triplets(2, 2, {{0, 0, 2.0}, {1, 1, 4.0}});
    problem.D = SparseMatrix::from_triplets(1, 2, {{0, 0, 1.0}, {0, 1, 1.0}});
    problem.a = {1.0, 2.0};
    problem.b = {0.5};
    problem.cones = {Cone::free(1)};
    return problem;
}

TEST(OwnPlugin, IsChosenByName) {
    Registry registry;
    registry.add(one_row());
    EXPECT_EQ(registry.find("one_row").description, "one row");
    EXPECT_TRUE(registry.find("one_row").library.empty());
    for (const bool right : {true, false}) {
        Solver solver = make_solver(registry, parse_solver(right ? "one_row" : "one_row(factor=2)"));
        Solution solution;
        const SolveReport report = solver.solve(PreparedProblem(one_row_problem()), solution, {});
        EXPECT_EQ(report.status, right ? Status::Solved : Status::FalseClaim);
        // u = x₁ + x₂ + ½ = 0 with x = H⁻¹(a + Dᵀλ): 1 + ½ + ¾ λ = 0.
        EXPECT_NEAR(solution.lambda[0], right ? -2.0 : -4.0, 1e-15);
    }
    // The plugins of the installation are found beside it, and in order.
    for (std::size_t k = 1; k < registry.plugins().size(); ++k)
        EXPECT_LT(registry.plugins()[k - 1].name, registry.plugins()[k].name);
}

TEST(OwnPlugin, NamesAreUniqueAndChecked) {
    Registry registry;
    registry.add(one_row());
    try {
        registry.add(one_row());
        FAIL() << "taken twice";
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(), "there is a solver \"one_row\" already");
    }
    delassus_plugin_descriptor descriptor{};
    descriptor.name = "nothing";
    try {
        static_cast<void>(Plugin::of(descriptor));
        FAIL() << "an empty descriptor was taken";
    } catch (const PluginError& error) {
        EXPECT_EQ(std::string(error.what()).rfind("the plugin nothing: its descriptor does not begin", 0), 0U);
    }
}

}  // namespace
}  // namespace delassus::tests::own_plugin_test
