// SPDX-License-Identifier: BSD-3-Clause
// Any solver of Delassus behind Bullet's interface for mixed linear complementarity problems.
#pragma once

#include <BulletDynamics/MLCPSolvers/btMLCPSolverInterface.h>

#include <string>

#include "delassus/problem.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"

/// Bullet asks for A x = b + w, lo ≤ x ≤ hi, w complementary. A row of friction names the row of its normal force in
/// limitDependency; Bullet's own solvers bound each such row by itself, μ x_n, which makes a pyramid. Here a normal row
/// and the rows after it that name it become one cone of friction, ‖x_t‖ ≤ μ x_n, with μ = hi of these rows: choose two
/// directions of friction (SOLVER_USE_2_FRICTION_DIRECTIONS). Any other row keeps its bounds.
class DelassusMlcp : public btMLCPSolverInterface {
public:
    /// solver: as --solver has it, "pgs" or "ssn(…)". tolerance: of the natural error; Bullet of Debian counts in
    /// single precision. Throws delassus::InputError.
    explicit DelassusMlcp(const std::string& solver = "auto", double tolerance = 1e-6)
        : solver_(make_solver(registry_, delassus::parse_solver(solver))) {
        settings_.tolerance = tolerance;
        settings_.warm_start = false;
    }

    bool solveMLCP(const btMatrixXu& A, const btVectorXu& b, btVectorXu& x, const btVectorXu& lo, const btVectorXu& hi,
                   const btAlignedObjectArray<int>& limitDependency, int, bool) override {
        if (A.rows() == 0) return true;
        const delassus::PreparedProblem problem = problem_of(A, b, lo, hi, limitDependency);
        delassus::Solution solution;
        report_ = solver_.solve(problem, solution, settings_);
        for (int i = 0; i < A.rows(); ++i) x[i] = static_cast<btScalar>(solution.lambda[static_cast<std::size_t>(i)]);
        // Bullet falls back on its own sweeps where this is false.
        return report_.status == delassus::Status::Solved;
    }

    /// Of the latest solve: status, time, errors as Delassus measures them.
    [[nodiscard]] const delassus::SolveReport& report() const { return report_; }

    /// The problem that Bullet poses, with cones of friction: n = 0, E = A, b = −b.
    static delassus::Problem problem_of(const btMatrixXu& A, const btVectorXu& b, const btVectorXu& lo,
                                        const btVectorXu& hi, const btAlignedObjectArray<int>& limitDependency) {
        const int m = A.rows();
        delassus::Problem problem;
        problem.law = delassus::Law::Coulomb;
        std::vector<delassus::Triplet> entries;
        for (int i = 0; i < m; ++i) {
            problem.b.push_back(-static_cast<double>(b[i]));
            // Bullet's matrix is symmetric up to rounding.
            for (int j = 0; j < m; ++j)
                if (A(i, j) != 0 || A(j, i) != 0)
                    entries.push_back({i, j, 0.5 * (static_cast<double>(A(i, j)) + static_cast<double>(A(j, i)))});
        }
        problem.E = delassus::SparseMatrix::from_triplets(m, m, std::move(entries));
        for (int i = 0; i < m;) {
            int rows = 1;
            while (i + rows < m && limitDependency[i + rows] == i) ++rows;
            if (rows > 1) {
                problem.cones.push_back(delassus::Cone::friction(static_cast<double>(hi[i + 1]), rows));
            } else {
                problem.cones.push_back(delassus::Cone::box({bound(lo[i])}, {bound(hi[i])}));
            }
            i += rows;
        }
        return problem;
    }

private:
    /// Bullet's infinity is a large number.
    static double bound(btScalar value) {
        const double wide = static_cast<double>(value);
        if (wide >= 1e9) return std::numeric_limits<double>::infinity();
        if (wide <= -1e9) return -std::numeric_limits<double>::infinity();
        return wide;
    }

    delassus::Registry registry_;
    delassus::Solver solver_;
    delassus::SolveSettings settings_;
    delassus::SolveReport report_;
};
