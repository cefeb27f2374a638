// SPDX-License-Identifier: BSD-3-Clause
// An example of a solver plugin: Uzawa's method with a projection, about as simple as a contact solver can be.
//
// The convex problem min ½ λᵀNλ + rᵀλ over λ ∈ Υ (associated law) is solved by projected gradient steps of a fixed
// length:
//
//     λ ← P_Υ(λ − ρ u),    u = N λ + r,
//
// which converge for 0 < ρ < 2/‖N‖ because N is symmetric positive semidefinite. ‖N‖ comes from a few power iterations.
#include "delassus/sdk/delassus_operator.hpp"
#include "delassus/sdk/monitor.hpp"
#include "delassus/sdk/residual.hpp"
#include "delassus/sdk/solver.hpp"

namespace {

using namespace delassus::sdk;

class Uzawa : public Solver {
public:
    explicit Uzawa(const OptionValues& options) : relaxation_(options.real("relaxation")) {}

    void analyze(const ProblemView& problem) override { N_.analyze(problem); }

    void factorize(const ProblemView& problem) override {
        N_.factorize(problem);
        Vector v = Vector::Ones(problem.m), Nv(problem.m);
        norm_ = 0.0;
        for (int k = 0; k < power_iterations && problem.m > 0 && v.norm() > 0.0; ++k) {
            v.normalize();
            N_.apply(problem, v, Nv);
            norm_ = Nv.norm();
            v = Nv;
        }
    }

    Outcome solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                  MutableVectorView lambda) override {
        const Vector r = N_.free_velocity(problem);
        const NaturalResidual residual(problem, N_.diagonal(), r);
        // Power iterations approach ‖N‖ from below: the margin keeps the step safe.
        const double rho = norm_ > 0.0 ? relaxation_ / (1.05 * norm_) : 1.0;
        Monitor monitor(request, stall_window);

        Vector iterate = request.warm_start() ? Vector(lambda) : Vector(Vector::Zero(problem.m));
        Vector u(problem.m);
        for (std::int64_t k = 0;; ++k) {
            for (const auto& cone : problem.cones) project(cone, iterate.data() + cone.first_row);
            N_.apply(problem, iterate, u);
            u += r;
            if (monitor.check(k, nullptr, iterate, residual.natural(iterate, u))) break;
            iterate -= rho * u;
        }
        lambda = monitor.best();
        x = N_.velocity(problem, lambda);
        return monitor.outcome();
    }

    [[nodiscard]] std::int64_t analyses() const override { return N_.inverse().analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return N_.inverse().factorizations(); }

private:
    static constexpr int power_iterations = 30;
    static constexpr std::int64_t stall_window = 5000;

    double relaxation_;
    double norm_ = 0.0;
    DelassusOperator N_;
};

constexpr delassus_option option_table[] = {
    real_option("relaxation", "1.0", 0.01, 1.9, "", "Step length as a multiple of 1/‖N‖"),
};

constexpr PluginInfo info{
    .name = "uzawa",
    .version = "1.0.0",
    .description = "Uzawa's method with projection: an example",
    .licence = "BSD-3-Clause",
    .capabilities = delassus::sdk::all_cones | DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_H_DIAGONAL |
                    DELASSUS_CAN_H_BLOCKS | DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_REDUCED | DELASSUS_CAN_COMPLIANCE |
                    DELASSUS_CAN_REDUNDANT | DELASSUS_CAN_WARM_START,
};

}  // namespace

DELASSUS_SOLVER_PLUGIN(Uzawa, info, option_table)
