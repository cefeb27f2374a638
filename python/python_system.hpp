// SPDX-License-Identifier: BSD-3-Clause
// A DynamicalSystem whose methods are Python's.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "delassus/dynamical_system.hpp"

namespace delassus::python {

namespace py = pybind11;

/// Asks an object of delassus/_system.py, which has asked and checked the user's: shapes are right, types are those
/// read here. Its methods take the state as (t, q, v). What they raise passes through the library as
/// py::error_already_set. All of it may be called without the GIL.
class PythonSystem final : public DynamicalSystem {
public:
    /// With the GIL. methods: the names of those that the object has beside what every system has.
    explicit PythonSystem(py::object object)
        : object_(std::move(object)),
          n_(object_.attr("n").cast<std::int32_t>()),
          position_size_(object_.attr("position_size").cast<std::int32_t>()),
          blocks_(object_.attr("constraint_blocks").cast<std::vector<std::int32_t>>()),
          methods_(object_.attr("methods").cast<std::set<std::string, std::less<>>>()),
          recovery_speed_(object_.attr("recovery_speed").cast<double>()),
          free_fall_(object_.attr("free_fall").cast<double>()),
          gap_resolution_(object_.attr("gap_resolution").cast<double>()) {}
    ~PythonSystem() override {
        const py::gil_scoped_acquire with_gil;
        object_ = py::object();
    }

    [[nodiscard]] std::int32_t n() const override { return n_; }
    [[nodiscard]] std::int32_t position_size() const override { return position_size_; }
    [[nodiscard]] std::vector<std::int32_t> constraint_blocks() const override { return blocks_; }
    [[nodiscard]] State initial_state() const override {
        const py::gil_scoped_acquire with_gil;
        const py::tuple start(object_.attr("initial_state")());
        State state;
        state.t = start[0].cast<double>();
        assign(state.q, start[1]);
        assign(state.v, start[2]);
        return state;
    }

    void increment(const double* q, const double* delta, double* result) const override {
        if (!has("increment")) return DynamicalSystem::increment(q, delta, result);
        const py::gil_scoped_acquire with_gil;
        copy(object_.attr("increment")(array(q, position_size_), array(delta, n_)), result);
    }
    void difference(const double* from, const double* to, double* delta) const override {
        if (!has("difference")) return DynamicalSystem::difference(from, to, delta);
        const py::gil_scoped_acquire with_gil;
        copy(object_.attr("difference")(array(from, position_size_), array(to, position_size_)), delta);
    }
    void inverse_tangent(const double* delta, std::vector<DiagonalBlock3>& blocks) const override {
        blocks.clear();
        if (!has("inverse_tangent")) return;
        const py::gil_scoped_acquire with_gil;
        for (const py::handle& entry : py::list(object_.attr("inverse_tangent")(array(delta, n_)))) {
            const py::tuple pair = py::reinterpret_borrow<py::tuple>(entry);
            DiagonalBlock3& block = blocks.emplace_back();
            block.first = pair[0].cast<std::int32_t>();
            copy(pair[1], block.value);
        }
    }

    void add_mass(const State& state, double factor, MatrixAssembler& M) const override {
        const py::gil_scoped_acquire with_gil;
        add(ask("mass", state), factor, Tangent::Exact, 0, M);
    }
    void multiply_mass(const State& state, double factor, const double* x, double* result) const override {
        const py::gil_scoped_acquire with_gil;
        add(ask("multiply_mass", state, array(x, n_)), factor, result);
    }
    void add_force(const State& state, double factor, double* result) const override {
        const py::gil_scoped_acquire with_gil;
        add(ask("force", state), factor, result);
    }
    bool accelerate(const State& state, double* v_dot) const override {
        if (!has("acceleration")) return false;
        const py::gil_scoped_acquire with_gil;
        copy(ask("acceleration", state), v_dot);
        return true;
    }
    void add_stiffness(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const override {
        add_if_any("stiffness", state, factor, tangent, H);
    }
    void add_damping(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const override {
        add_if_any("damping", state, factor, tangent, H);
    }
    void add_gyroscopic_damping(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const override {
        add_if_any("gyroscopic_damping", state, factor, tangent, H);
    }
    void free_spins(const State& state, double h, std::vector<FreeSpin>& spins) const override {
        spins.clear();
        if (!has("free_spins")) return;
        const py::gil_scoped_acquire with_gil;
        for (const py::handle& entry : py::list(ask("free_spins", state, py::float_(h)))) {
            const py::tuple parts = py::reinterpret_borrow<py::tuple>(entry);
            FreeSpin& spin = spins.emplace_back();
            spin.column = parts[0].cast<std::int32_t>();
            spin.alone = parts[1].cast<bool>();
            copy(parts[2], spin.torque.data());
            copy(parts[3], spin.impulse.data());
            copy(parts[4], spin.speed.data());
            copy(parts[5], spin.turn.data());
        }
    }
    void add_inertial_stiffness(const State& state, const double* acceleration, double factor, Tangent tangent,
                                MatrixAssembler& H) const override {
        if (!has("inertial_stiffness")) return;
        const py::gil_scoped_acquire with_gil;
        add(ask("inertial_stiffness", state, array(acceleration, n_)), factor, tangent, 0, H);
    }
    [[nodiscard]] bool has_stiffness() const override { return has("stiffness") || has("damping"); }

    void constraint(const State& state, double* C) const override {
        if (blocks_.empty()) return;
        const py::gil_scoped_acquire with_gil;
        copy(ask("constraint", state), C);
    }
    void add_constraint_jacobian(const State& state, std::int32_t first_row, MatrixAssembler& D) const override {
        if (blocks_.empty()) return;
        const py::gil_scoped_acquire with_gil;
        add(ask("constraint_jacobian", state), 1.0, Tangent::Exact, first_row, D);
    }
    void constraint_rate(const State& state, double* C_t) const override {
        if (!has("constraint_rate")) return DynamicalSystem::constraint_rate(state, C_t);
        const py::gil_scoped_acquire with_gil;
        copy(ask("constraint_rate", state), C_t);
    }
    void constraint_curvature(const State& state, double* c) const override {
        if (!has("constraint_curvature")) return DynamicalSystem::constraint_curvature(state, c);
        const py::gil_scoped_acquire with_gil;
        copy(ask("constraint_curvature", state), c);
    }
    void add_constraint_stiffness(const State& state, const double* lambda, double factor, Tangent tangent,
                                  MatrixAssembler& H) const override {
        if (!has("constraint_stiffness")) return;
        const py::gil_scoped_acquire with_gil;
        add(ask("constraint_stiffness", state, array(lambda, m())), factor, tangent, 0, H);
    }
    void add_definite_constraint_stiffness(const State& state, const double* lambda, double factor,
                                           MatrixAssembler& H) const override {
        if (!has("definite_constraint_stiffness")) return;
        const py::gil_scoped_acquire with_gil;
        add(ask("definite_constraint_stiffness", state, array(lambda, m())), factor, Tangent::Symmetric, 0, H);
    }

    [[nodiscard]] bool has_unilateral() const override { return has("unilateral"); }
    void collect_unilateral(const State& state, double h, UnilateralRows& rows) override {
        rows.clear();
        if (!has("unilateral")) return;
        const py::gil_scoped_acquire with_gil;
        for (const py::handle& entry : py::list(ask("unilateral", state, py::float_(h)))) {
            const py::tuple parts = py::reinterpret_borrow<py::tuple>(entry);
            const auto cone = parts[0].cast<Cone>();
            const auto gap = parts[1].cast<Array<double>>(), rate = parts[2].cast<Array<double>>();
            const auto starts = parts[3].cast<Array<std::int32_t>>(), columns = parts[4].cast<Array<std::int32_t>>();
            const auto values = parts[5].cast<Array<double>>();
            for (std::int32_t row = 0; row < cone.rows; ++row) {
                for (std::int32_t k = starts.at(row); k < starts.at(row + 1); ++k)
                    rows.entry(columns.at(k), values.at(k));
                rows.end_row(gap.at(row), rate.at(row));
            }
            rows.end_block(cone, parts[6].cast<std::uint64_t>(), parts[7].cast<double>(), parts[8].cast<double>());
        }
    }

    [[nodiscard]] double recovery_speed() const override { return recovery_speed_; }
    [[nodiscard]] double free_fall() const override { return free_fall_; }
    [[nodiscard]] double gap_resolution() const override { return gap_resolution_; }
    [[nodiscard]] double energy(const State& state) const override {
        if (!has("energy")) return std::numeric_limits<double>::quiet_NaN();
        const py::gil_scoped_acquire with_gil;
        return ask("energy", state).cast<double>();
    }

private:
    template <typename Value>
    using Array = py::array_t<Value, py::array::c_style | py::array::forcecast>;

    [[nodiscard]] bool has(const char* method) const { return methods_.count(method) > 0; }

    /// A copy, which the user may keep.
    static py::array_t<double> array(const double* values, std::int32_t size) {
        return py::array_t<double>(size, values);
    }
    static py::array_t<double> array(const std::vector<double>& values) {
        return array(values.data(), static_cast<std::int32_t>(values.size()));
    }
    template <typename... Arguments>
    [[nodiscard]] py::object ask(const char* method, const State& state, const Arguments&... arguments) const {
        return object_.attr(method)(state.t, array(state.q), array(state.v), arguments...);
    }

    static void copy(const py::object& from, double* to) {
        const Array<double> values(from);
        std::copy_n(values.data(), values.size(), to);
    }
    static void assign(std::vector<double>& to, const py::object& from) {
        const Array<double> values(from);
        to.assign(values.data(), values.data() + values.size());
    }
    static void add(const py::object& from, double factor, double* to) {
        const Array<double> values(from);
        for (py::ssize_t i = 0; i < values.size(); ++i) to[i] += factor * values.at(i);
    }
    /// A dense matrix, whose zeros make no entries, or (rows, columns, values), or () for nothing.
    static void add(const py::object& matrix, double factor, Tangent tangent, std::int32_t first_row,
                    MatrixAssembler& to) {
        const auto put = [&](std::int32_t row, std::int32_t column, double value) {
            if (tangent == Tangent::Exact) {
                to.add(first_row + row, column, factor * value);
            } else {
                to.add(row, column, 0.5 * factor * value);
                to.add(column, row, 0.5 * factor * value);
            }
        };
        if (py::isinstance<py::array>(matrix)) {
            const Array<double> dense(matrix);
            const double* value = dense.data();
            for (std::int32_t row = 0; row < dense.shape(0); ++row)
                for (std::int32_t column = 0; column < dense.shape(1); ++column, ++value)
                    if (*value != 0.0) put(row, column, *value);
            return;
        }
        const py::tuple parts(matrix);
        if (parts.empty()) return;
        const auto rows = parts[0].cast<Array<std::int32_t>>(), columns = parts[1].cast<Array<std::int32_t>>();
        const auto values = parts[2].cast<Array<double>>();
        for (py::ssize_t k = 0; k < values.size(); ++k) put(rows.at(k), columns.at(k), values.at(k));
    }
    void add_if_any(const char* method, const State& state, double factor, Tangent tangent, MatrixAssembler& H) const {
        if (!has(method)) return;
        const py::gil_scoped_acquire with_gil;
        add(ask(method, state), factor, tangent, 0, H);
    }

    py::object object_;
    std::int32_t n_, position_size_;
    std::vector<std::int32_t> blocks_;
    std::set<std::string, std::less<>> methods_;
    double recovery_speed_, free_fall_, gap_resolution_;
};

}  // namespace delassus::python
