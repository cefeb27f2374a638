// SPDX-License-Identifier: BSD-3-Clause
// Numbers that overflow or vanish when they are multiplied: every installed solver ends with a status, a message and
// finite values, or the problem is refused; none crashes, and none claims what nobody could measure.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "delassus/error.hpp"
#include "delassus/solver_config.hpp"
#include "solver/judgement.hpp"
#include "support/finite.hpp"
#include "support/solving.hpp"

namespace delassus::numbers_test {
namespace {

using tests::infinity;

/// Two masses with one block of each kind.
Problem mixed(Law law, bool blocks) {
    Problem problem;
    problem.name = "numbers";
    std::vector<Triplet> H;
    for (std::int32_t i = 0; i < 6; ++i) H.push_back({i, i, 2.0});
    if (blocks) H.insert(H.end(), {{0, 1, 0.5}, {1, 0, 0.5}});
    problem.H = SparseMatrix::from_triplets(6, 6, H);
    problem.D = SparseMatrix::from_triplets(
        6, 6,
        {{0, 0, 1.0}, {0, 3, -1.0}, {1, 1, 1.0}, {2, 2, 1.0}, {3, 3, 1.0}, {4, 4, 1.0}, {5, 5, 1.0}, {5, 0, 0.5}});
    problem.E = SparseMatrix::from_triplets(6, 6, {{4, 4, 0.1}});
    problem.a = {-3.0, 1.0, 0.5, -2.0, 1.0, 1.0};
    problem.b = {0.0, 0.0, 0.1, -0.1, 0.2, 0.0};
    problem.cones = {Cone::friction(0.5), Cone::nonnegative(1), Cone::box({-1.0}, {2.0}), Cone::nonnegative(1)};
    problem.law = law;
    return problem;
}

Problem small(Law law) {
    Problem problem = tests::one_row(1.0, -1.0, Cone::nonnegative(1));
    problem.law = law;
    return problem;
}

/// Free rows only, for solvers of linear systems.
Problem linear(Law law) {
    Problem problem = mixed(law, true);
    problem.cones = {Cone::free(6)};
    return problem;
}

using Change = std::function<void(Problem&, double)>;
const std::map<std::string, Change>& places() {
    static const std::map<std::string, Change> all = {
        {"H", [](Problem& p, double value) { p.H.value[0] = std::abs(value); }},
        {"all of H",
         [](Problem& p, double value) {
             for (double& entry : p.H.value) entry *= std::abs(value);
         }},
        {"D", [](Problem& p, double value) { p.D.value[0] = value; }},
        {"all of D",
         [](Problem& p, double value) {
             for (double& entry : p.D.value) entry *= value;
         }},
        {"E",
         [](Problem& p, double value) {
             if (!p.E.value.empty()) p.E.value[0] = std::abs(value);
         }},
        {"a", [](Problem& p, double value) { p.a[0] = value; }},
        {"b", [](Problem& p, double value) { p.b.back() = value; }},
        {"mu",
         [](Problem& p, double value) {
             for (Cone& cone : p.cones)
                 if (cone.kind == ConeKind::Friction) cone.parameters[0] = std::abs(value);
         }},
        {"bounds", [](Problem& p, double value) {
             for (Cone& cone : p.cones)
                 if (cone.kind == ConeKind::Box) {
                     cone.lo[0] = -std::abs(value);
                     cone.hi[0] = std::abs(value);
                 }
         }}};
    return all;
}

void try_one(const Registry& registry, const std::string& name, const Problem& problem, const std::string& what) {
    SCOPED_TRACE(name + ", " + what);
    Solution solution;
    SolveReport report;
    try {
        const PreparedProblem prepared(problem);
        Solver solver = make_solver(registry, parse_solver(name));
        SolveSettings settings = tests::to(1e-8, 500);
        settings.time_limit = 20.0;
        if (!solver.refusal(prepared, settings).empty()) return;
        report = solver.solve(prepared, solution, settings);
    } catch (const Error& refusal) {
        EXPECT_FALSE(std::string(refusal.what()).empty());
        return;
    }
    EXPECT_TRUE(all_finite(solution.x) && all_finite(solution.lambda));
    if (report.status == Status::Solved) {
        EXPECT_TRUE(std::isfinite(worst_of(report.error)));
    } else {
        EXPECT_TRUE(!report.message.empty() || report.status == Status::IterationLimit ||
                    report.status == Status::TimeLimit)
            << name_of(report.status);
    }
}

class Numbers : public testing::TestWithParam<std::string> {};

TEST_P(Numbers, OverflowIsAStatusOrARefusal) {
    const Registry registry;
    for (const Law law : {Law::Associated, Law::Coulomb})
        for (const auto& [name, problem] : {std::pair("small", small(law)), std::pair("diagonal", mixed(law, false)),
                                            std::pair("blocks", mixed(law, true)), std::pair("linear", linear(law))})
            for (const auto& [place, change] : places())
                for (const double value : {-1e160, 1e308, 1e-160, 1e-320}) {
                    Problem changed = problem;
                    change(changed, value);
                    try_one(registry, GetParam(), changed,
                            std::string(name) + ", " + place + " = " + std::to_string(std::log10(std::abs(value))));
                }
}

std::vector<std::string> all_solvers() {
    std::vector<std::string> names{"auto"};
    const Registry registry;
    for (const auto& plugin : registry.plugins()) names.push_back(plugin.name);
    return names;
}

INSTANTIATE_TEST_SUITE_P(Of, Numbers, testing::ValuesIn(all_solvers()), [](const auto& of) {
    std::string name = of.param;
    std::ranges::replace(name, '-', '_');
    return name;
});

TEST(Friction, BeyondItsBoundIsRefused) {
    for (const Law law : {Law::Associated, Law::Coulomb}) {
        EXPECT_NO_THROW(PreparedProblem(tests::point_on_plane(1.0, 1.0, 5.0, 1e4, law)));
        for (const double mu : {1.1e4, 1e10, 1e300, infinity, -1.0, std::nan("")}) {
            try {
                const PreparedProblem prepared(tests::point_on_plane(1.0, 1.0, 5.0, mu, law));
                ADD_FAILURE() << mu;
            } catch (const InputError& error) {
                EXPECT_NE(std::string(error.what()).find("friction coefficient"), std::string::npos) << error.what();
                EXPECT_NE(std::string(error.what()).find("at most 10000"), std::string::npos) << error.what();
            }
        }
    }
}

// The largest friction sticks: what is pressed stays on the plane, whatever pushes it along.
TEST(Friction, UpToItsBoundSticks) {
    const Registry registry;
    for (const Law law : {Law::Associated, Law::Coulomb})
        for (const double mu : {1e2, 1e3, 1e4})
            for (const double push : {1e-3, 1.0, 1e3}) {
                const PreparedProblem problem(tests::point_on_plane(1.0, 1.0, push, mu, law));
                Solver solver = make_solver(registry, parse_solver("auto"));
                Solution solution;
                const auto report = solver.solve(problem, solution, tests::to(1e-8));
                if (law == Law::Associated && push > mu) continue;  // there it lifts off
                EXPECT_EQ(report.status, Status::Solved) << mu << ' ' << push << report.message;
                EXPECT_NEAR(solution.x[0], 0.0, 1e-3 * std::max(1.0, push)) << mu << ' ' << push;
            }
}

TEST(Friction, VanishingCoefficientsAreFrictionless) {
    for (const double mu : {0.0, 1e-320, 1e-160}) {
        const PreparedProblem problem(tests::point_on_plane(2.0, 6.0, 5.0, mu, Law::Coulomb));
        const std::vector<double> x = {0.0, 2.5, 0.0}, lambda = {6.0, 0.0, 0.0};
        EXPECT_LE(worst_of(ErrorMeter(problem).measure(x, lambda)), 1e-12) << mu;
        EXPECT_LE(ErrorMeter(problem).measure(x, lambda).dual, 1e-12) << mu;
    }
}

TEST(Judgement, AMeasureThatIsNotFiniteFailsTheClaim) {
    for (const ErrorMeasure& measure : error_measures)
        for (const double value : {std::nan(""), infinity}) {
            SolveReport report;
            report.solver = "one";
            report.tolerance = 1e-8;
            report.status = Status::Solved;
            report.error.*measure.value = value;
            judge(report, true, [] { return RoundingOfBalance(); });
            EXPECT_NE(report.status, Status::Solved) << measure.name;
            EXPECT_FALSE(report.message.empty()) << measure.name;
            EXPECT_EQ(worst_of(report.error), infinity) << measure.name;
        }
}

}  // namespace
}  // namespace delassus::numbers_test
