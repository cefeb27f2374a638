// SPDX-License-Identifier: BSD-3-Clause
// Keeps all the rules: one dense rank-revealing factorisation of the saddle-point matrix, for linear problems with any
// H. It never calls progress.
#include <Eigen/Dense>

#include "delassus/sdk/solver.hpp"

namespace {

using namespace delassus::sdk;

class Direct : public Solver {
public:
    explicit Direct(const OptionValues&) {}

    void analyze(const ProblemView&) override { ++analyses_; }

    // [H −Dᵀ; D E] {x; λ} = {a; −b}
    void factorize(const ProblemView& problem) override {
        const Eigen::Index n = problem.n, m = problem.m;
        K_.setZero(n + m, n + m);
        K_.topLeftCorner(n, n) = Eigen::MatrixXd(problem.H);
        K_.topRightCorner(n, m) = -Eigen::MatrixXd(problem.D).transpose();
        K_.bottomLeftCorner(m, n) = Eigen::MatrixXd(problem.D);
        if (problem.E.nonZeros() > 0) K_.bottomRightCorner(m, m) = Eigen::MatrixXd(problem.E);
        factor_.compute(K_);
        ++factorizations_;
    }

    Outcome solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                  MutableVectorView lambda) override {
        Vector right(problem.n + problem.m);
        right << problem.a, -problem.b;
        Vector solution = factor_.solve(right);
        solution += factor_.solve(right - K_ * solution);
        x = solution.head(problem.n);
        lambda = solution.tail(problem.m);
        // Without a measure of the natural error it claims nothing that could be finer than its rounding.
        const double residual = (right - K_ * solution).norm() / std::max(right.norm(), 1e-300);
        Outcome outcome;
        if (residual <= 1e-13 && request.tolerance() >= 1e-11) {
            outcome.status = DELASSUS_SOLVED;
        } else {
            outcome.status = DELASSUS_STALLED;
            outcome.message = residual <= 1e-13 ? "it promises no error below 1e-11" : "the equations have no solution";
        }
        if (request.max_iterations() == 0 && outcome.status != DELASSUS_SOLVED)
            outcome.status = DELASSUS_ITERATION_LIMIT;
        return outcome;
    }

    std::int64_t analyses() const override { return analyses_; }
    std::int64_t factorizations() const override { return factorizations_; }

private:
    Eigen::MatrixXd K_;
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> factor_;
    std::int64_t analyses_ = 0, factorizations_ = 0;
};

constexpr std::uint64_t capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                                       DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_H_SEMIDEFINITE |
                                       DELASSUS_CAN_H_INDEFINITE | DELASSUS_CAN_H_UNSYMMETRIC | DELASSUS_CAN_REDUCED |
                                       DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT;

}  // namespace

DELASSUS_SOLVER_PLUGIN(Direct,
                       (PluginInfo{"direct", "1.0", "dense direct solver that keeps all the rules", "BSD-3-Clause",
                                   capabilities, 0}),
                       nullptr)
