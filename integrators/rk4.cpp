// SPDX-License-Identifier: BSD-3-Clause
// The classical Runge–Kutta method of order 4 on the Lie group, in the form of Munthe-Kaas; for reference.
#include "dynamics/linear_problem.hpp"

namespace delassus {
namespace {

// Within a step the position is q(t) = q_n ∘ exp(u(t)) with u(t_n) = 0. q̇ = v means that q(t + dt) = q(t) ∘ exp(v dt),
// and as exp(u + T⁻¹(u) ε) = exp(u) ∘ exp(ε) to first order,
//
//     u̇ = T⁻¹(u) v,      v̇ = M(q_n ∘ exp(u))⁻¹ f(q_n ∘ exp(u), v, t)
//
// This is an ordinary differential equation for (u, v) in a vector space: any Runge–Kutta method keeps its order on it
// (Munthe-Kaas, Applied Numerical Mathematics 29, 1999). Without T⁻¹, that is with the sums of velocities of the seed's
// remark after eq. 54, it would be 2 where rotations do not commute.
class RungeKutta4 : public Timestepper {
public:
    explicit RungeKutta4(DynamicalSystem& system) : system_(system), accelerations_(system), n_(system.n()) {}

    void restart() override {}
    [[nodiscard]] int order() const override { return 4; }

private:
    void take_step(State& state, double h, StepSolver& solver, StepReport& report) override {
        require_step(system_, state, h, "rk4");
        const Eigen::Map<const Vector> v(state.v.data(), n_);
        const Slope k1 = slope(state, 0.0, Vector::Zero(n_), v, solver, report);
        const Slope k2 = slope(state, 0.5 * h, 0.5 * h * k1.u, v + 0.5 * h * k1.v, solver, report);
        const Slope k3 = slope(state, 0.5 * h, 0.5 * h * k2.u, v + 0.5 * h * k2.v, solver, report);
        const Slope k4 = slope(state, h, h * k3.u, v + h * k3.v, solver, report);
        const Vector u = h / 6.0 * (k1.u + 2.0 * k2.u + 2.0 * k3.u + k4.u);
        const Vector v_end = v + h / 6.0 * (k1.v + 2.0 * k2.v + 2.0 * k3.v + k4.v);
        State end = state;
        system_.increment(state.q.data(), u.data(), end.q.data());
        end.v.assign(v_end.begin(), v_end.end());
        end.t = state.t + h;
        require_finite(state, end, h, "rk4");
        state = std::move(end);
    }

    struct Slope {
        Vector u, v;
    };

    Slope slope(const State& begin, double after, const Vector& u, const Vector& v, StepSolver& solver,
                StepReport& report) {
        State stage = begin;
        system_.increment(begin.q.data(), u.data(), stage.q.data());
        stage.v.assign(v.begin(), v.end());
        stage.t = begin.t + after;
        system_.inverse_tangent(u.data(), blocks_);
        return {multiply_blocks(blocks_, v), accelerations_.at(stage, solver, report).x};
    }

    DynamicalSystem& system_;
    Accelerations accelerations_;
    std::int32_t n_;
    std::vector<DiagonalBlock3> blocks_;
};

const RegisterTimestepper rk4_row{
    {.name = "rk4",
     .description = "Runge–Kutta–Munthe-Kaas of order 4; without constraints, for reference",
     .options = {},
     .constraints = false,
     .unilateral = false,
     .order = 4,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>&) -> std::unique_ptr<Timestepper> {
         return std::make_unique<RungeKutta4>(system);
     }}};

}  // namespace
}  // namespace delassus
