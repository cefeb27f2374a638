// SPDX-License-Identifier: BSD-3-Clause
#include <csignal>

#include "support/mpi_plugin_tests.hpp"

namespace delassus::petsc_test {
namespace {

class Petsc : public tests::PluginTest {
protected:
    Petsc() : PluginTest("petsc", 1e-8) {}

    void expect_refused(const OptionTexts& options, const std::string& part) const {
        try {
            static_cast<void>(make(options));
            ADD_FAILURE() << "not refused, expected: " << part;
        } catch (const Error& error) {
            EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
        }
    }
};

TEST_F(Petsc, AgreesWithDenseFactorsForEveryStructure) {
    expect_every_structure();
}
TEST_F(Petsc, TakesComplianceAndReducedProblems) {
    expect_compliance_and_reduced();
}
TEST_F(Petsc, AnalysesOneHundredSolvesOnce) {
    expect_reuse();
}
TEST_F(Petsc, TwoInstancesDoNotMeet) {
    expect_two_instances();
}
TEST_F(Petsc, PrintsNothing) {
    expect_silence();
}
TEST_F(Petsc, ReturnsTheStartForZeroIterations) {
    expect_zero_iterations_return_the_start();
}
TEST_F(Petsc, CanBeCancelled) {
    expect_cancel();
}
TEST_F(Petsc, ClaimsNothingForContradictingRows) {
    expect_no_false_claim_on_contradiction();
}

TEST_F(Petsc, TakesExactlyLinearisedGyroscopicTorque) {
    expect_solved(generate_gyroscopic({}));
    expect_solved(generate_gyroscopic({}), {{"method", "gmres"}, {"preconditioner", "schur_upper"}});
}

TEST_F(Petsc, SolvesChainsWithMassRatiosAndRepeatedJoints) {
    for (const std::int32_t bodies : {10, 100, 1000, 10000})
        for (const double ratio : {1.0, 1e9}) expect_solved(chain(bodies, ratio, false, 1));
    expect_solved(chain(1000, 1e9, true, 3));
    expect_solved(chain(10000, 1e9, true, 2));
}

TEST_F(Petsc, EveryMethodSolves) {
    const Problem problem = chain(30, 100.0, false, 2);
    for (const char* method :
         {"fgmres", "gmres", "lgmres", "gcr", "minres", "bcgs", "tfqmr", "richardson", "preonly", "schur_cg"}) {
        SCOPED_TRACE(method);
        expect_solved(problem, {{"method", method}});
    }
}

TEST_F(Petsc, EveryPreconditionerSolves) {
    const Problem problem = tests::spring_row(12, 1.0, 4.0, 0.0, {2, 7});
    for (const char* preconditioner :
         {"schur_full", "schur_lower", "schur_upper", "schur_diagonal", "factorization", "jacobi", "none"})
        for (const char* schur : {"automatic", "diagonal", "selfp"}) {
            SCOPED_TRACE(std::string(preconditioner) + " " + schur);
            expect_reference(problem, {{"preconditioner", preconditioner}, {"schur_matrix", schur}});
        }
}

TEST_F(Petsc, TakesPetscsOwnOptions) {
    expect_reference(tests::spring_row(12, 1.0, 4.0, 0.0, {2, 7}),
                     {{"petsc_options", "-ksp_type gcr -fieldsplit_lambda_pc_type jacobi"}});
    // Two solvers with options that differ: neither sees the other's.
    Solver plain = make(), odd = make({{"petsc_options", "-ksp_type richardson -ksp_richardson_scale 0.5"}});
    const PreparedProblem prepared(tests::tied_masses());
    Solution a, b;
    const auto quick = plain.solve(prepared, a, settings()), slow = odd.solve(prepared, b, settings());
    EXPECT_EQ(quick.status, Status::Solved);
    EXPECT_EQ(slow.status, Status::Solved);
    EXPECT_LT(quick.iterations, 5);
    EXPECT_GT(slow.iterations, 10);
}

TEST_F(Petsc, RefusesOptionsItCannotUse) {
    expect_refused({{"petsc_options", "-ksp_tyep gmres"}}, "-ksp_tyep");
    expect_refused({{"petsc_options", "-ksp_type nonsense"}}, "nonsense");
    expect_refused({{"petsc_options", "-ksp_monitor"}}, "print");
    expect_refused({{"petsc_options", "gmres"}}, "neither an option nor a value");
    expect_refused({{"method", "minres"}, {"preconditioner", "schur_full"}}, "definite preconditioner");
    EXPECT_THROW(static_cast<void>(make({{"method", "sor"}})), InputError);
}

TEST_F(Petsc, LeavesTheHostsSignalHandlers) {
    struct sigaction before {
    }, after{};
    sigaction(SIGSEGV, nullptr, &before);
    const Solver solver = make();
    sigaction(SIGSEGV, nullptr, &after);
    EXPECT_EQ(before.sa_handler, after.sa_handler);
}

TEST_F(Petsc, SharesOneMpiWithMumps) {
    try {
        Solver mumps(registry_.load("mumps"), {}, &registry_);
        Solver petsc = make();
        const PreparedProblem prepared(tests::tied_masses());
        Solution a, b;
        EXPECT_EQ(mumps.solve(prepared, a, settings()).status, Status::Solved);
        EXPECT_EQ(petsc.solve(prepared, b, settings()).status, Status::Solved);
    } catch (const InputError&) {
        GTEST_SKIP() << "mumps was not built";
    }
}

}  // namespace
}  // namespace delassus::petsc_test
