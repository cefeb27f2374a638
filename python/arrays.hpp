// SPDX-License-Identifier: BSD-3-Clause
// NumPy's arrays and the library's vectors.
#pragma once

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "borrowing.hpp"
#include "delassus/error.hpp"
#include "delassus/problem.hpp"

namespace delassus::python {

namespace py = pybind11;

using Reals = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Integers = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;

/// An array of this shape that takes over the memory of a vector with as many entries.
template <typename Value>
py::array_t<Value> array_of(std::vector<Value>&& values, std::vector<py::ssize_t> shape) {
    auto owned = std::make_unique<std::vector<Value>>(std::move(values));
    const Value* data = owned->data();
    const py::capsule owner(owned.get(), [](void* vector) { delete static_cast<std::vector<Value>*>(vector); });
    static_cast<void>(owned.release());
    return py::array_t<Value>(std::move(shape), data, owner);
}
template <typename Value>
py::array_t<Value> array_of(std::vector<Value>&& values) {
    const auto size = static_cast<py::ssize_t>(values.size());
    return array_of(std::move(values), {size});
}

/// A read-only array in the memory of the values, which owner keeps alive and unchanged.
template <typename Value>
py::array view_of(const Array<Value>& values, const py::object& owner) {
    py::array view(py::dtype::of<Value>(), {static_cast<py::ssize_t>(values.size())}, values.data(), owner);
    view.attr("setflags")(py::arg("write") = false);
    return view;
}

/// Throws InputError naming the array unless it has one dimension.
inline void require_one_dimension(const py::array& array, std::string_view name) {
    if (array.ndim() != 1)
        throw InputError(fmt::format("{} has {} dimensions; it must be an array with one", name, array.ndim()));
}

/// A copy of an array with one dimension; throws InputError naming it otherwise.
inline std::vector<double> vector_of(const Reals& array, std::string_view name) {
    require_one_dimension(array, name);
    return {array.data(), array.data() + array.size()};
}

inline std::vector<double> vector_of(const Array<double>& values) {
    return {values.begin(), values.end()};
}

/// An array of reals with one dimension, lent or copied; throws InputError naming it otherwise.
inline Array<double> reals_of(const py::array& array, std::string_view name, Lender& lender) {
    const Reals reals(array);  // the array itself where its type and order fit
    require_one_dimension(reals, name);
    return lender.values_of<double>(reals);
}

/// Indices as the library counts them, lent or copied; throws InputError where they do not fit.
inline Array<std::int32_t> indices_of(const py::array& array, std::string_view name, Lender& lender) {
    if (py::isinstance<py::array_t<std::int32_t>>(array) && (array.flags() & py::array::c_style))
        return lender.values_of<std::int32_t>(array);
    const Integers wide(array);
    std::vector<std::int32_t> result(static_cast<std::size_t>(wide.size()));
    const auto fits = [](std::int64_t index) {
        return index >= 0 && index <= std::numeric_limits<std::int32_t>::max();
    };
    if (!std::all_of(wide.data(), wide.data() + wide.size(), fits))
        throw InputError(fmt::format("{} has an index that does not fit into 32 bits", name));
    std::transform(wide.data(), wide.data() + wide.size(), result.begin(),
                   [](std::int64_t index) { return static_cast<std::int32_t>(index); });
    return result;
}

/// The matrix (indptr, indices, data, (rows, columns)) by compressed rows, lent or copied.
inline SparseMatrix matrix_of(const py::tuple& parts, std::string_view name, Lender& lender) {
    SparseMatrix matrix;
    const auto shape = parts[3].cast<std::pair<std::int64_t, std::int64_t>>();
    if (std::max(shape.first, shape.second) > std::numeric_limits<std::int32_t>::max())
        throw InputError(
            fmt::format("{} is {} × {}: indices do not fit into 32 bits", name, shape.first, shape.second));
    matrix.rows = static_cast<std::int32_t>(shape.first);
    matrix.columns = static_cast<std::int32_t>(shape.second);
    matrix.row_start = indices_of(parts[0].cast<py::array>(), name, lender);
    matrix.column = indices_of(parts[1].cast<py::array>(), name, lender);
    matrix.value = reals_of(parts[2].cast<py::array>(), name, lender);
    return matrix;
}

}  // namespace delassus::python
