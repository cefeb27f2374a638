// SPDX-License-Identifier: BSD-3-Clause
// The explicit Euler method on the Lie group. Order 1; for reference.
#include "dynamics/linear_problem.hpp"

namespace delassus {
namespace {

// q̇ = v and M v̇ = f with all of it at the beginning of the step; the position moves along the exponential of h v (seed
// eq. 54), so that a unit quaternion stays one:
//
//     q_{n+1} = q_n ∘ exp(h v_n),      v_{n+1} = v_n + h M(q_n)⁻¹ f(q_n, v_n, t_n)
//
// Stable for |1 + h μ| ≤ 1 only: never for an undamped oscillation, which grows by √(1 + h²ω²) a step.
class EulerExplicit : public Timestepper {
public:
    explicit EulerExplicit(DynamicalSystem& system) : system_(system), accelerations_(system), n_(system.n()) {}

    void restart() override {}
    [[nodiscard]] int order() const override { return 1; }

private:
    void take_step(State& state, double h, StepSolver& solver, StepReport& report) override {
        require_step(system_, state, h, "euler_explicit");
        const Vector v_dot = accelerations_.at(state, solver, report).x;
        const Eigen::Map<Vector> v(state.v.data(), n_);
        const Vector delta = h * v;
        const Vector v_end = v + h * v_dot;
        State end = state;
        system_.increment(state.q.data(), delta.data(), end.q.data());
        end.v.assign(v_end.begin(), v_end.end());
        end.t = state.t + h;
        require_finite(state, end, h, "euler_explicit");
        state = std::move(end);
    }

    DynamicalSystem& system_;
    Accelerations accelerations_;
    std::int32_t n_;
};

const RegisterTimestepper euler_explicit_row{
    {.name = "euler_explicit",
     .description = "explicit Euler on the Lie group; without constraints, for reference",
     .options = {},
     .constraints = false,
     .unilateral = false,
     .order = 1,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>&) -> std::unique_ptr<Timestepper> {
         return std::make_unique<EulerExplicit>(system);
     }}};

}  // namespace
}  // namespace delassus
