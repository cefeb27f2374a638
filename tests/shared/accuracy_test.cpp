// SPDX-License-Identifier: BSD-3-Clause
// How exact the answers to the shared contact problems are: `auto` under the associated law, claims under both, and the
// velocities of two methods that share nothing but their finish.
#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <map>
#include <string>

#include "delassus/config.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/sdk/problem_view.hpp"
#include "support/shared_problems.hpp"
#include "support/solving.hpp"

namespace delassus::tests::accuracy_test {
namespace {

const Registry& registry() {
    static const Registry instance;
    return instance;
}

class Accuracy : public testing::TestWithParam<std::filesystem::path> {
protected:
    void SetUp() override {
#if defined(__SANITIZE_ADDRESS__)
        if (read_problem(GetParam()).m() > 1000) GTEST_SKIP() << "too slow under the sanitizers";
#endif
    }
    [[nodiscard]] static std::string name() {
        return GetParam().filename().string();
    }
    [[nodiscard]] static PreparedProblem problem(Law law) {
        Problem data = read_problem(GetParam());
        data.law = law;
        return PreparedProblem(std::move(data));
    }
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(Accuracy);

Solved solve(const std::string& solver, const PreparedProblem& problem, const SolveSettings& settings) {
    Solved result;
    result.report = make_solver(registry(), parse_solver(solver)).solve(problem, result.solution, settings);
    return result;
}

/// ‖x − y‖_H / ‖x‖_H; for n = 0 the same of u, each block by its scaling. What rests is compared with what would be
/// without reactions, as ErrorMeter::velocity does.
double difference(const PreparedProblem& problem, const Solution& first, const Solution& second) {
    if (problem.raw().n > 0) return problem.meter().velocity(second.x, first.x);
    const sdk::ProblemView view(problem.raw());
    const auto velocity = [&](const Solution& solution) {
        return sdk::Vector(view.E * sdk::VectorView(solution.lambda.data(), view.m) + view.b);
    };
    const sdk::Vector u = velocity(first), v = velocity(second);
    double apart = 0.0, size = 0.0, without = 0.0;
    for (const auto& cone : view.cones) {
        const auto rows = [&](const auto& w) { return w.segment(cone.first_row, cone.rows); };
        double trace = 0.0;
        for (int i = 0; i < cone.rows; ++i) trace += view.E.coeff(cone.first_row + i, cone.first_row + i);
        const double weight = trace > 0.0 ? cone.rows / trace : 0.0;
        apart += weight * rows(sdk::Vector(u - v)).squaredNorm();
        size += weight * rows(u).squaredNorm();
        without += weight * rows(view.b).squaredNorm();
    }
    return std::sqrt(apart / (size > 1e-16 * without ? size : without));
}

// Asked: 1e-11. heavytop, with bodies 1e4 times as heavy as others, ends where rounding leaves 5e-12 of the natural
// error.
TEST_P(Accuracy, AutoReachesElevenDigitsUnderTheAssociatedLaw) {
    const auto report = solve("auto", problem(Law::Associated), to(1e-11)).report;
    EXPECT_EQ(report.status, Status::Solved) << report.error.natural << ' ' << report.message;
    EXPECT_LE(report.error.natural, name().starts_with("heavytop") ? 2e-11 : 1.001e-11) << report.message;
}

TEST_P(Accuracy, ClaimsOfAutoAreTrue) {
    for (const Law law : {Law::Associated, Law::Coulomb}) {
        const auto prepared = problem(law);
        // Exact Coulomb has no certificate of a best answer. wall10 ends between 1e-7 and 1e-8, after minutes; heavytop
        // above 1e-10.
        const bool wall = law == Law::Coulomb && name().starts_with("wall10");
        const bool top = law == Law::Coulomb && name().starts_with("heavytop");
        for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
            const bool hard = (wall && tolerance < 1e-5) || (top && tolerance < 1e-9);
            const auto report = solve("auto", prepared, to(tolerance, hard ? 3000 : 1'000'000)).report;
            EXPECT_NE(report.status, Status::FalseClaim) << name_of(law) << ' ' << tolerance << ' ' << report.message;
            if (hard) continue;
            EXPECT_EQ(report.status, Status::Solved)
                << name_of(law) << ' ' << tolerance << ' ' << report.error.natural << ' ' << report.message;
            EXPECT_LE(report.error.natural, 1.001 * tolerance) << name_of(law) << ' ' << report.message;
        }
    }
}

// An interior point and a splitting method, each to the last digits by a semismooth Newton method: the velocities are
// unique, and agree.
TEST_P(Accuracy, TwoMethodsAgreeInVelocity) {
    const auto prepared = problem(Law::Associated);
    const SolveSettings settings = to(1e-11);
    const Solved one = solve("ipm(finish=ssn,finish_at=1e-8)", prepared, settings);
    const Solved other = solve("admm(finish=ssn,finish_at=1e-6)", prepared, settings);
    const double reached = name().starts_with("heavytop") ? 2e-11 : 1.001e-11;
    EXPECT_LE(one.report.error.natural, reached) << one.report.message;
    EXPECT_LE(other.report.error.natural, reached) << other.report.message;
    EXPECT_LE(difference(prepared, one.solution, other.solution), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Problems, Accuracy, testing::ValuesIn(shared_problem_folders()), [](const auto& test) {
    std::string text = test.param.filename().string();
    for (char& c : text)
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    return text;
});

}  // namespace
}  // namespace delassus::tests::accuracy_test
