// SPDX-License-Identifier: BSD-3-Clause
#include "sweeps.hpp"

#include <Eigen/Dense>
#include <algorithm>

#include "delassus/sdk/delassus_operator.hpp"
#include "delassus/sdk/monitor.hpp"
#include "delassus/sdk/options.hpp"
#include "delassus/sdk/residual.hpp"
#include "delassus/sdk/solver.hpp"

namespace fixture {

namespace {

using namespace delassus::sdk;

constexpr const char* orders[] = {"forward", "symmetric"};
constexpr delassus_option options[] = {
    real_option("relaxation", "1", 0.1, 1.0, "", "factor of each row's correction"),
    integer_option("stall_window", "5000", 0, 1000000, "iterations", "iterations without progress that end a solve"),
    choice_option("order", "forward", orders, "order in which the rows are visited"),
};

constexpr std::uint64_t capabilities = all_cones | DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_COULOMB |
                                       DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS | DELASSUS_CAN_H_DEFINITE |
                                       DELASSUS_CAN_REDUCED | DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT |
                                       DELASSUS_CAN_WARM_START;

class Sweeps : public Solver {
public:
    explicit Sweeps(const OptionValues& values)
        : relaxation_(values.real("relaxation")),
          stall_window_(values.integer("stall_window")),
          symmetric_(values.choice("order") == "symmetric") {}

    void analyze(const ProblemView& problem) override {
        operator_.analyze(problem);
        ++analyses_;
    }

    void factorize(const ProblemView& problem) override {
        operator_.factorize(problem);
        N_ = operator_.formed(problem);
        ++factorizations_;
    }

    Outcome solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                  MutableVectorView lambda) override {
        const Vector r = operator_.free_velocity(problem);
        const NaturalResidual residual(problem, operator_.diagonal(), r);
        Monitor monitor(request, stall_window_);
        Vector iterate = request.warm_start() ? Vector(lambda) : Vector::Zero(problem.m);
        for (const auto& cone : problem.cones) project(cone, iterate.data() + cone.first_row);
        for (std::int64_t iteration = 0;; ++iteration) {
            const Vector u = N_ * iterate + r;
            if (monitor.check(iteration, nullptr, iterate, residual.natural(iterate, u))) break;
            sweep(problem, r, iterate, symmetric_ && iteration % 2 == 1);
        }
        lambda = monitor.best_residual() >= 0.0 ? monitor.best() : Vector::Zero(problem.m);
        x = operator_.velocity(problem, lambda);
        return monitor.outcome();
    }

    std::int64_t analyses() const override { return analyses_; }
    std::int64_t factorizations() const override { return factorizations_; }

private:
    void sweep(const ProblemView& problem, const Vector& r, Vector& lambda, bool backwards) const {
        const auto count = problem.cones.size();
        for (std::size_t k = 0; k < count; ++k) {
            const auto& cone = problem.cones[backwards ? count - 1 - k : k];
            if (is_separable(cone)) {
                for (std::int32_t i = 0; i < cone.rows; ++i) step_row(cone, i, r, lambda);
            } else {
                step_block(problem, cone, r, lambda);
            }
        }
    }

    void step_row(const delassus_cone& cone, std::int32_t i, const Vector& r, Vector& lambda) const {
        const Eigen::Index row = cone.first_row + i;
        if (N_(row, row) <= 0.0) return;
        const auto [lo, hi] = operations_of(cone).interval(cone, i);
        const double trial = lambda[row] - relaxation_ * (N_.row(row).dot(lambda) + r[row]) / N_(row, row);
        lambda[row] = std::min(hi, std::max(lo, trial));
    }

    void step_block(const ProblemView& problem, const delassus_cone& cone, const Vector& r, Vector& lambda) const {
        const auto rows = cone.rows;
        // The largest row sum bounds the largest eigenvalue of N_cc.
        const double bound = N_.block(cone.first_row, cone.first_row, rows, rows).cwiseAbs().rowwise().sum().maxCoeff();
        if (bound <= 0.0) return;
        Vector u = N_.middleRows(cone.first_row, rows) * lambda + r.segment(cone.first_row, rows);
        if (problem.coulomb) u[0] += de_saxce(cone, u.data());
        lambda.segment(cone.first_row, rows) -= relaxation_ / bound * u;
        project(cone, lambda.data() + cone.first_row);
    }

    double relaxation_;
    std::int64_t stall_window_;
    bool symmetric_;
    DelassusOperator operator_;
    Eigen::MatrixXd N_;
    std::int64_t analyses_ = 0, factorizations_ = 0;
};

}  // namespace

delassus_plugin_descriptor sweeps(const char* name, const char* description) {
    return Border<Sweeps>::descriptor(PluginInfo{name, "1.0", description, "BSD-3-Clause", capabilities, 0}, options);
}

}  // namespace fixture
