// SPDX-License-Identifier: BSD-3-Clause
// An example of a dynamical system written by hand: two masses in the plane, the first on a spring that hardens, and
// either free of each other (an ordinary differential equation) or joined by a rod (a differential-algebraic one).
//
//     system TIMESTEPPER [SOLVER]     with a rod; SOLVER is the name of a plugin
//     system TIMESTEPPER free         without
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>

#include "delassus/timestepper.hpp"

namespace {

using namespace delassus;

// q = (x₁, y₁, x₂, y₂), gravity along −y.
//     f₁ = −k (1 + |p₁|²) p₁ + m₁ g,   f₂ = m₂ g,   C = (|p₂ − p₁|² − L²)/(2L)
class TwoMasses : public DynamicalSystem {
public:
    explicit TwoMasses(bool rod) : rod_(rod) {}

    std::int32_t n() const override { return 4; }
    std::vector<std::int32_t> constraint_blocks() const override {
        return rod_ ? std::vector<std::int32_t>{1} : std::vector<std::int32_t>{};
    }
    State initial_state() const override { return {0.0, {0.3, 0.0, 0.3 + length, 0.0}, {0.0, 0.0, 0.0, 0.0}}; }

    void add_mass(const State&, double factor, MatrixAssembler& M) const override {
        for (std::int32_t i = 0; i < 4; ++i) M.add(i, i, factor * mass(i));
    }
    void multiply_mass(const State&, double factor, const double* x, double* result) const override {
        for (std::int32_t i = 0; i < 4; ++i) result[i] += factor * mass(i) * x[i];
    }
    void add_force(const State& state, double factor, double* result) const override {
        const double x = state.q[0], y = state.q[1], spring = stiffness * (1.0 + x * x + y * y);
        result[0] -= factor * spring * x;
        result[1] -= factor * spring * y;
        for (const std::int32_t i : {1, 3}) result[i] -= factor * mass(i) * gravity;
    }
    // K = k ((1 + |p|²) I + 2 p pᵀ)
    void add_stiffness(const State& state, double factor, Tangent, MatrixAssembler& H) const override {
        const double p[2] = {state.q[0], state.q[1]}, square = p[0] * p[0] + p[1] * p[1];
        for (std::int32_t i = 0; i < 2; ++i)
            for (std::int32_t j = 0; j < 2; ++j)
                H.add(i, j, factor * stiffness * ((i == j ? 1.0 + square : 0.0) + 2.0 * p[i] * p[j]));
    }

    void constraint(const State& state, double* C) const override {
        const double x = state.q[2] - state.q[0], y = state.q[3] - state.q[1];
        if (rod_) C[0] = (x * x + y * y - length * length) / (2.0 * length);
    }
    void add_constraint_jacobian(const State& state, std::int32_t row, MatrixAssembler& D) const override {
        const double* q = state.q.data();
        for (std::int32_t i = 0; i < 2; ++i) {
            const double slope = (q[i + 2] - q[i]) / length;
            D.add(row, i, -slope);
            D.add(row, i + 2, slope);
        }
    }
    void constraint_curvature(const State& state, double* c) const override {
        const double x = state.v[2] - state.v[0], y = state.v[3] - state.v[1];
        c[0] = (x * x + y * y) / length;
    }
    void add_constraint_stiffness(const State&, const double* lambda, double factor, Tangent,
                                  MatrixAssembler& H) const override {
        for (std::int32_t i = 0; i < 4; ++i) {
            H.add(i, i, factor * lambda[0] / length);
            H.add(i, (i + 2) % 4, -factor * lambda[0] / length);
        }
    }

    double energy(const State& state) const override {
        const double *q = state.q.data(), *v = state.v.data();
        const double square = q[0] * q[0] + q[1] * q[1];
        double result = stiffness * (0.5 * square + 0.25 * square * square);
        for (std::int32_t i = 0; i < 4; ++i) result += 0.5 * mass(i) * v[i] * v[i];
        for (const std::int32_t i : {1, 3}) result += mass(i) * gravity * q[i];
        return result;
    }

private:
    static constexpr double length = 0.5, stiffness = 200.0, gravity = 9.81;
    static double mass(std::int32_t i) { return i < 2 ? 1.0 : 0.5; }
    bool rod_;
};

}  // namespace

int main(int argc, char** argv) {
    try {
        if (argc < 2) throw InputError("usage: system TIMESTEPPER [SOLVER|free]");
        const std::string choice = argc > 2 ? argv[2] : "";
        TwoMasses system(choice != "free");
        const Registry registry;
        SolverConfig config;
        config.name = choice == "free" ? "" : choice;
        config.tolerance = 1e-10;
        StepSolver solver(registry, config);
        const auto stepper = make_timestepper(argv[1], system);

        State state = system.initial_state();
        const double before = system.energy(state), h = 1e-3;
        for (int step = 0; step < 1000; ++step) stepper->step(state, h, solver);
        double drift = 0.0;
        system.constraint(state, &drift);
        std::printf(
            "%s: t = %.3f s, first mass at (%.6f, %.6f) m, energy change %.2e J, rod error %.1e m, %lld solves\n",
            argv[1], state.t, state.q[0], state.q[1], system.energy(state) - before, std::abs(drift),
            static_cast<long long>(solver.effort().plugin_solves));
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
    }
}
