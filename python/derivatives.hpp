// SPDX-License-Identifier: BSD-3-Clause
// What delassus/_derivative.py needs of the linear system of a solution's derivative.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "linearization.hpp"
#include "problems.hpp"

namespace delassus::python {

inline Eigen::VectorXd eigen_of(const Reals& values, std::int32_t size, std::string_view name) {
    const std::vector<double> checked = vector_of(values, name);
    if (checked.size() != static_cast<std::size_t>(size))
        throw InputError(fmt::format("{} has the shape ({},); it must be ({},)", name, checked.size(), size));
    return Eigen::Map<const Eigen::VectorXd>(checked.data(), size);
}

inline py::array_t<double> array_of(const Eigen::VectorXd& values) {
    return array_of(std::vector<double>(values.data(), values.data() + values.size()));
}

/// Σ left rightᵀ at the entries of the pattern.
inline std::vector<double> outer(const SparseMatrix& pattern, const Eigen::VectorXd& left,
                                 const Eigen::VectorXd& right) {
    std::vector<double> result(static_cast<std::size_t>(pattern.entries()));
    for (std::int32_t row = 0; row < pattern.rows; ++row)
        for (auto k = pattern.row_start[row]; k < pattern.row_start[row + 1]; ++k)
            result[static_cast<std::size_t>(k)] = left[row] * right[pattern.column[k]];
    return result;
}

inline void bind_derivatives(py::module_& module) {
    using namespace py::literals;
    using Vector = Eigen::VectorXd;

    const auto matrix_parts = [](const Linearization& self, bool moved) {
        std::vector<double> values;
        std::vector<std::int32_t> rows, columns;
        for (const auto& unit : self.units())
            for (std::int32_t i = 0; i < unit.rows(); ++i)
                for (std::int32_t j = 0; j < unit.rows(); ++j) {
                    values.push_back(moved ? unit.moved(i, j) : unit.J(i, j));
                    rows.push_back(unit.first + i);
                    columns.push_back(unit.first + j);
                }
        return py::make_tuple(array_of(std::move(values)),
                              py::make_tuple(array_of(std::move(rows)), array_of(std::move(columns))));
    };
    py::class_<Linearization>(module, "_Linearization")
        .def(py::init(
                 [](const SharedProblem& problem, const Reals& lambda, const Reals& u, bool coulomb, double tolerance) {
                     return std::make_unique<Linearization>(*problem.prepared, vector_of(lambda, "lam"),
                                                            vector_of(u, "u"), coulomb, tolerance);
                 }),
             py::keep_alive<1, 2>())
        .def_property_readonly("degenerate", &Linearization::degenerate)
        .def_property_readonly("local", [](const Linearization& self) { return array_of(std::vector(self.local())); })
        .def_property_readonly("has_small_blocks", &Linearization::has_small_blocks)
        .def("J", [matrix_parts](const Linearization& self) { return matrix_parts(self, false); })
        .def("JC", [matrix_parts](const Linearization& self) { return matrix_parts(self, true); })
        .def("factorize",
             [](Linearization& self, double compliance) {
                 const py::gil_scoped_release without_gil;
                 return self.factorize(compliance);
             })
        .def("solve",
             [](const Linearization& self, const Reals& first, const Reals& second) {
                 const auto [x, lambda] = self.solve(eigen_of(first, self.n(), "a"), eigen_of(second, self.m(), "b"));
                 return py::make_tuple(array_of(x), array_of(lambda));
             })
        .def("solve_transposed",
             [](const Linearization& self, const Reals& to_x, const Reals& to_lambda) {
                 const auto [p, q] =
                     self.solve_transposed(eigen_of(to_x, self.n(), "x"), eigen_of(to_lambda, self.m(), "lam"));
                 return py::make_tuple(array_of(p), array_of(q));
             })
        .def("moved",
             [](const Linearization& self, const Reals& v) { return array_of(self.moved(eigen_of(v, self.m(), "u"))); })
        .def("velocities",
             [](const Linearization& self, const Reals& x, const Reals& lambda) {
                 return array_of(Vector(self.rows_times(eigen_of(x, self.n(), "x")) +
                                        self.compliance_times(eigen_of(lambda, self.m(), "lam"), false)));
             })
        .def("by_mu",
             [](const Linearization& self, const Reals& mu) {
                 const auto cones = static_cast<std::int32_t>(self.problem().cones.size());
                 const Vector change = eigen_of(mu, cones, "mu");
                 Vector result = Vector::Zero(self.m());
                 for (const auto& unit : self.units())
                     result.segment(unit.first, unit.rows()) = change[unit.cone] * unit.by_mu;
                 return array_of(result);
             })
        .def("gradient_parts",
             [](const Linearization& self, const Reals& given_p, const Reals& given_q, const Reals& given_u,
                const Reals& given_x, const Reals& given_lambda) {
                 const Vector p = eigen_of(given_p, self.n(), "x"), q = eigen_of(given_q, self.m(), "lam"),
                              x = eigen_of(given_x, self.n(), "x"), lambda = eigen_of(given_lambda, self.m(), "lam");
                 const Vector w = eigen_of(given_u, self.m(), "u") - self.moved_back(q);
                 std::vector<double> mu(self.problem().cones.size(), 0.0);
                 for (const auto& unit : self.units())
                     mu[static_cast<std::size_t>(unit.cone)] += unit.by_mu.dot(q.segment(unit.first, unit.rows()));
                 std::vector<double> by_D = outer(self.problem().D, lambda, p);
                 const std::vector<double> more = outer(self.problem().D, w, x);
                 for (std::size_t k = 0; k < by_D.size(); ++k) by_D[k] += more[k];
                 return py::make_tuple(array_of(w), array_of(std::move(mu)), array_of(outer(self.problem().H, -p, x)),
                                       array_of(std::move(by_D)), array_of(outer(self.problem().E, w, lambda)));
             })
        .def("gradient_start",
             [](const Linearization& self, const Reals& to_x, const Reals& to_lambda, const Reals& to_u) {
                 const Vector u = eigen_of(to_u, self.m(), "u");
                 const Vector x = eigen_of(to_x, self.n(), "x") + self.columns_times(u);
                 const Vector lambda = eigen_of(to_lambda, self.m(), "lam") + self.compliance_times(u, true);
                 return py::make_tuple(array_of(x), array_of(lambda));
             });
}

}  // namespace delassus::python
