// SPDX-License-Identifier: BSD-3-Clause
// Any solver of Delassus behind Bullet's interface for mixed linear complementarity problems.
#pragma once

#include <BulletDynamics/MLCPSolvers/btMLCPSolverInterface.h>

#include <limits>
#include <string>
#include <vector>

#include "delassus/problem.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"

/// Bullet asks for A x = b + w, lo ≤ x ≤ hi, w complementary. A row of friction names the row of its normal force in
/// limitDependency; Bullet's own solvers bound each such row by itself, μ x_n, which makes a pyramid. Here a normal row
/// and the rows that name it become one cone of friction, ‖x_t‖ ≤ μ x_n, with μ = hi of these rows: choose two
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
        const std::vector<int> rows = order_of(limitDependency);
        const delassus::PreparedProblem problem(problem_of(A, b, lo, hi, limitDependency));
        delassus::Solution solution;
        report_ = solver_.solve(problem, solution, settings_);
        for (std::size_t k = 0; k < rows.size(); ++k) x[rows[k]] = static_cast<btScalar>(solution.lambda[k]);
        // Bullet falls back on its own sweeps where this is false.
        return report_.status == delassus::Status::Solved;
    }

    /// Of the latest solve: status, time, errors as Delassus measures them.
    [[nodiscard]] const delassus::SolveReport& report() const { return report_; }

    /// Bullet's rows in the order of the problem: each normal row with those that name it.
    static std::vector<int> order_of(const btAlignedObjectArray<int>& limitDependency) {
        std::vector<int> rows;
        for (int i = 0; i < limitDependency.size(); ++i) {
            if (limitDependency[i] >= 0) continue;
            rows.push_back(i);
            for (int j = 0; j < limitDependency.size(); ++j)
                if (limitDependency[j] == i) rows.push_back(j);
        }
        return rows;
    }

    /// The problem that Bullet poses, with cones of friction: n = 0, E = A, b = −b, rows as in order_of().
    static delassus::Problem problem_of(const btMatrixXu& A, const btVectorXu& b, const btVectorXu& lo,
                                        const btVectorXu& hi, const btAlignedObjectArray<int>& limitDependency) {
        const std::vector<int> rows = order_of(limitDependency);
        const auto m = static_cast<std::int32_t>(rows.size());
        delassus::Problem problem;
        problem.law = delassus::Law::Coulomb;
        std::vector<delassus::Triplet> entries;
        for (std::int32_t k = 0; k < m; ++k) {
            const int i = rows[static_cast<std::size_t>(k)];
            problem.b.push_back(-static_cast<double>(b[i]));
            // Bullet's matrix is symmetric up to rounding.
            for (std::int32_t l = 0; l < m; ++l) {
                const int j = rows[static_cast<std::size_t>(l)];
                const double value = 0.5 * (static_cast<double>(A(i, j)) + static_cast<double>(A(j, i)));
                if (value != 0.0) entries.push_back({k, l, value});
            }
            if (limitDependency[i] >= 0) {
                ++problem.cones.back().rows;
                problem.cones.back() = delassus::Cone::friction(static_cast<double>(hi[i]), problem.cones.back().rows);
            } else {
                problem.cones.push_back(delassus::Cone::box({bound(lo[i])}, {bound(hi[i])}));
            }
        }
        problem.E = delassus::SparseMatrix::from_triplets(m, m, std::move(entries));
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
