// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "delassus/dynamical_system.hpp"
#include "delassus/matrix_assembler.hpp"

namespace delassus::tests {

/// A unit mass at rest that a force of 100 N pushes from t = 1 on, of which it says nothing to anybody.
class SuddenLoad : public DynamicalSystem {
public:
    [[nodiscard]] std::int32_t n() const override { return 1; }
    [[nodiscard]] State initial_state() const override { return {0.0, {0.0}, {0.0}}; }
    void add_mass(const State&, double factor, MatrixAssembler& M) const override { M.add(0, 0, factor); }
    void multiply_mass(const State&, double factor, const double* x, double* result) const override {
        result[0] += factor * x[0];
    }
    void add_force(const State& state, double factor, double* result) const override {
        if (state.t >= 1.0) result[0] += factor * 100.0;
    }
};

}  // namespace delassus::tests
