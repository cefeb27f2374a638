// SPDX-License-Identifier: BSD-3-Clause
// Any solver of Delassus in Bullet:
//
//     DelassusMlcp solver("auto");
//     btMLCPSolver constraints(&solver);
//     btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration);
//     world.getSolverInfo().m_solverMode |=
//         SOLVER_USE_2_FRICTION_DIRECTIONS | SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION;
//
// Without the two modes Bullet gives contacts one direction of friction, and they have friction in that one only.
#pragma once

#include <BulletDynamics/MLCPSolvers/btMLCPSolverInterface.h>

#include <string>

#include "boxed_lcp.hpp"

class DelassusMlcp : public btMLCPSolverInterface {
public:
    /// As BoxedLcp; where Bullet counts in single precision, ask for no more than 1e-5. Throws delassus::InputError.
    explicit DelassusMlcp(const std::string& solver = "auto", double tolerance = 1e-10, double needed = 1e-6)
        : lcp_(solver, tolerance, needed) {}

    /// False where Bullet should fall back on its own sweeps.
    bool solveMLCP(const btMatrixXu& A, const btVectorXu& b, btVectorXu& x, const btVectorXu& lo, const btVectorXu& hi,
                   const btAlignedObjectArray<int>& limitDependency, int, bool) override {
        return A.rows() == 0 || lcp_.solve(A.rows(), A, b, x, lo, hi, limitDependency);
    }

    /// Status, time and errors of the latest solve; the problem that was solved.
    [[nodiscard]] const BoxedLcp& lcp() const { return lcp_; }

private:
    BoxedLcp lcp_;
};
