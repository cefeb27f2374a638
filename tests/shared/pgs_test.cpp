// SPDX-License-Identifier: BSD-3-Clause
// Projected Gauss-Seidel on the shared contact problems: a natural error of 1e-4 under both laws, with the defaults.
// Left out are heavytop (mass ratio 1e4: sweeping methods stay above 1e-1) and spheres-in-a-box (slow for every
// first-order method).
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "delassus/config.hpp"
#include "delassus/problem_files.hpp"
#include "support/shared_problems.hpp"

namespace delassus::tests::pgs_test {
namespace {

struct Case {
    std::string problem;
    Law law;
};

std::vector<Case> cases() {
    const std::set<std::string> out_of_reach = {"heavytop-40-nc40", "spheres-in-a-box-98-i10000-256-10"};
    std::vector<Case> all;
    for (const auto& folder : shared_problem_folders())
        for (const Law law : {Law::Associated, Law::Coulomb})
            if (!out_of_reach.contains(folder.filename().string())) all.push_back({folder.filename().string(), law});
    return all;
}

class PgsOnShared : public ::testing::TestWithParam<Case> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(PgsOnShared);

TEST_P(PgsOnShared, ReachesOneInTenThousand) {
    Problem data = read_problem(shared_problems_root() / GetParam().problem);
    data.law = GetParam().law;
    const PreparedProblem problem(std::move(data));
    const Registry registry;
    Solver solver = make_solver(registry, parse_solver("pgs"));
    SolveSettings settings;
    settings.tolerance = 1e-4;
    settings.max_iterations = 100000000;
    settings.time_limit = 60.0;
    Solution solution;
    const SolveReport report = solver.solve(problem, solution, settings);
    EXPECT_EQ(report.status, Status::Solved) << name_of(report.status) << " at " << report.error.natural << " after "
                                             << report.iterations << " sweeps, " << report.seconds_solve << " s";
    EXPECT_LE(report.error.natural, 1e-4);
}

INSTANTIATE_TEST_SUITE_P(Problems, PgsOnShared, ::testing::ValuesIn(cases()), [](const auto& parameters) {
    std::string name = parameters.param.problem + "_" + std::string(name_of(parameters.param.law));
    for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    return name;
});

}  // namespace
}  // namespace delassus::tests::pgs_test
