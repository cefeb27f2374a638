// SPDX-License-Identifier: BSD-3-Clause
// Any solver of Delassus in DART:
//
//     world->setConstraintSolver(std::make_unique<dart::constraint::BoxedLcpConstraintSolver>(
//         std::make_shared<DelassusBoxedLcpSolver>("auto"), std::make_shared<dart::constraint::PgsBoxedLcpSolver>()));
//
// Define NDEBUG if DART was compiled with it, and only then: without it DART's class has a virtual function more.
// Debian's DART was compiled without it.
#pragma once

#include <dart/constraint/BoxedLcpSolver.hpp>
#include <string>

#include "boxed_lcp.hpp"

class DelassusBoxedLcpSolver : public dart::constraint::BoxedLcpSolver {
public:
    /// As BoxedLcp. Throws delassus::InputError.
    explicit DelassusBoxedLcpSolver(const std::string& solver = "auto", double tolerance = 1e-10, double needed = 1e-6)
        : lcp_(solver, tolerance, needed) {}

    const std::string& getType() const override {
        static const std::string type = "DelassusBoxedLcpSolver";
        return type;
    }

    /// A: n rows, each filled up to a multiple of four; stays as it is. False where DART should take its second solver.
    bool solve(int n, double* A, double* x, double* b, int, double* lo, double* hi, int* findex, bool) override {
        return lcp_.solve(n, Rows{A, n}, b, x, lo, hi, findex);
    }

#ifndef NDEBUG
    bool canSolve(int, const double*) override {
        return true;
    }
#endif

    /// Status, time and errors of the latest solve; the problem that was solved.
    [[nodiscard]] const BoxedLcp& lcp() const {
        return lcp_;
    }

    /// DART's matrix.
    struct Rows {
        const double* A;
        int n;
        double operator()(int row, int column) const { return A[row * (n > 1 ? (n + 3) / 4 * 4L : n) + column]; }
    };

private:
    BoxedLcp lcp_;
};
