// SPDX-License-Identifier: BSD-3-Clause
// The error measures from parts against those of the whole problem.
#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "delassus/error.hpp"
#include "delassus/generate.hpp"
#include "delassus/prepared_part.hpp"
#include "delassus/problem_files.hpp"
#include "support/shared_problems.hpp"
#include "support/small_problems.hpp"

namespace delassus::measures_test {
namespace {

/// Numbers of the size of what velocities and reactions of the problem may be, the same on all processes.
Solution somewhere(const Problem& problem, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Solution solution;
    for (std::int32_t i = 0; i < problem.n(); ++i) solution.x.push_back(normal(random));
    for (std::int32_t i = 0; i < problem.m(); ++i) solution.lambda.push_back(normal(random));
    return solution;
}

std::span<const double> own_range(const std::vector<double>& all, const std::vector<std::int64_t>& start, int rank) {
    const auto r = static_cast<std::size_t>(rank);
    return std::span(all).subspan(static_cast<std::size_t>(start[r]),
                                  static_cast<std::size_t>(start[r + 1] - start[r]));
}

class Measures : public testing::Test {
protected:
    void expect_same(const Problem& problem) {
        const PreparedProblem whole(problem);
        const PreparedPart part(run, part_of(*run, problem));
        if (whole.structure() == Structure::Unsymmetric) {
            EXPECT_EQ(part.structure(), Structure::Unsymmetric);
            EXPECT_THROW(static_cast<void>(part.measure(part.problem().a, part.problem().b)), Unsupported);
            return;
        }
        const bool in_one_block = whole.structure() == Structure::Blocks || whole.structure() == Structure::Diagonal;
        if (in_one_block) {
            EXPECT_EQ(name_of(part.structure()), name_of(whole.structure()));
        }
        EXPECT_EQ(part.needs(), whole.needs() | DELASSUS_CAN_PARTITIONED)
            << part.describe(part.needs()) << " against " << whole.describe(whole.needs());
        for (unsigned seed = 1; seed <= 2; ++seed) {
            const Solution solution = somewhere(problem, seed);
            const auto x = own_range(solution.x, part.problem().column_start, run->rank());
            const auto lambda = own_range(solution.lambda, part.problem().row_start, run->rank());
            const Errors expected = whole.meter().measure(solution.x, solution.lambda);
            const Errors measured = part.measure(x, lambda);
            for (const ErrorMeasure& measure : error_measures) {
                const double value = expected.*measure.value;
                EXPECT_NEAR(measured.*measure.value, value, 1e-10 * std::abs(value)) << measure.name;
            }
            const double natural = whole.meter().natural(nullptr, solution.lambda.data());
            const double by_parts = part.natural(nullptr, lambda.data());
            if (std::isnan(natural)) {
                EXPECT_TRUE(std::isnan(by_parts));
            } else {
                EXPECT_NEAR(by_parts, natural, 1e-10 * natural);
            }
        }
    }

    std::shared_ptr<const Communicator> run = communicator_of_run();
};

TEST_F(Measures, OfGeneratedProblemsAreThoseOfTheWhole) {
    for (const Generator& family : generators()) {
        SCOPED_TRACE(family.name);
        for (const Law law : {Law::Associated, Law::Coulomb}) {
            Problem problem = generate(family.name, {});
            problem.law = law;
            expect_same(problem);
        }
    }
}

TEST_F(Measures, OfAPointAreThoseOfTheWhole) {
    expect_same(tests::point_on_plane(1.0, 1.0, 0.5, 0.5, Law::Associated));
}

// Whatever of the shared problems a clone has; an unsymmetric H is for problems in one part only.
TEST_F(Measures, OfSharedProblemsAreThoseOfTheWhole) {
    namespace fs = std::filesystem;
    std::vector<fs::path> folders = tests::shared_problem_folders();
    std::error_code ignored;
    for (const auto& entry :
         fs::directory_iterator(tests::shared_problems_root().parent_path() / "problems-robotics", ignored))
        if (fs::exists(entry.path() / "problem.json")) folders.push_back(entry.path());
    if (folders.empty()) GTEST_SKIP() << "no problems in " << tests::shared_problems_root();
    std::sort(folders.begin(), folders.end());
    for (const auto& folder : folders) {
        SCOPED_TRACE(folder.filename());
        const Problem problem = read_problem(folder);
        expect_same(problem);
    }
}

}  // namespace
}  // namespace delassus::measures_test
