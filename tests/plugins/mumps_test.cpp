// SPDX-License-Identifier: BSD-3-Clause
#include "support/mpi_plugin_tests.hpp"

namespace delassus::mumps_test {
namespace {

class Mumps : public tests::PluginTest {
protected:
    Mumps() : PluginTest("mumps", 1e-10) {}
};

TEST_F(Mumps, AgreesWithDenseFactorsForEveryStructure) {
    expect_every_structure();
}
TEST_F(Mumps, TakesComplianceAndReducedProblems) {
    expect_compliance_and_reduced();
}
TEST_F(Mumps, AnalysesOneHundredSolvesOnce) {
    expect_reuse();
}
TEST_F(Mumps, TwoInstancesDoNotMeet) {
    expect_two_instances();
}
TEST_F(Mumps, PrintsNothing) {
    expect_silence();
}
TEST_F(Mumps, ReturnsTheStartForZeroIterations) {
    expect_zero_iterations_return_the_start();
}
TEST_F(Mumps, CanBeCancelled) {
    expect_cancel();
}

TEST_F(Mumps, TakesExactlyLinearisedGyroscopicTorque) {
    expect_solved(generate_gyroscopic({}));
}

TEST_F(Mumps, SolvesChainsWithMassRatiosAndRepeatedJoints) {
    for (const std::int32_t bodies : {10, 100, 1000, 10000})
        for (const double ratio : {1.0, 1e9}) expect_solved(chain(bodies, ratio, false, 1));
    expect_solved(chain(1000, 1e9, true, 3));
    expect_solved(chain(10000, 1e9, true, 2));
}

TEST_F(Mumps, TellsTheNullPivotsOfRepeatedRows) {
    Solution solution;
    const auto report = solve(chain(50, 1.0, false, 2), solution);
    EXPECT_EQ(report.status, Status::Solved);
    EXPECT_NE(report.message.find("150 null pivots"), std::string::npos) << report.message;
}

TEST_F(Mumps, SolvesWithShiftedFactorsToo) {
    const OptionTexts shift = {{"redundant_rows", "shift"}};
    expect_reference(tests::with_row_repeated(tests::spring_row(12, 1.0, 40.0, 0.0, {2, 7})), shift);
    expect_solved(chain(200, 1e9, false, 2), shift);
}

TEST_F(Mumps, ProvesContradictingRowsInfeasible) {
    expect_no_false_claim_on_contradiction();
    Solution solution;
    const auto report = solve(tests::with_row_repeated(tests::spring_row(12, 1.0, 40.0, 0.0, {2, 7}), 0.3), solution);
    EXPECT_EQ(report.status, Status::Infeasible) << report.message;
    EXPECT_NE(report.message.find("contradict"), std::string::npos);
}

TEST_F(Mumps, AnalysesErrorsInFull) {
    Solution solution;
    const auto report = solve(tests::spring_row(12, 1.0, 40.0, 0.0, {2, 7}), solution, {{"error_analysis", "full"}});
    EXPECT_EQ(report.status, Status::Solved);
    EXPECT_NE(report.message.find("condition numbers"), std::string::npos) << report.message;
}

TEST_F(Mumps, TakesEveryOrdering) {
    for (const char* ordering : {"amd", "amf", "qamd", "scotch", "metis", "pord"})
        expect_reference(tests::spring_row(40, 1.0, 40.0, 0.0, {2, 7, 30}), {{"ordering", ordering}});
}

TEST_F(Mumps, GivesMoreMemoryByItself) {
    expect_solved(chain(300, 1.0, false, 3), {{"memory_relaxation", "0"}});
}

TEST_F(Mumps, RefusesBadOptions) {
    EXPECT_THROW(static_cast<void>(make({{"ordering", "random"}})), InputError);
    EXPECT_THROW(static_cast<void>(make({{"pivot_threshold", "2"}})), InputError);
}

}  // namespace
}  // namespace delassus::mumps_test
