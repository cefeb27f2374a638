// SPDX-License-Identifier: BSD-3-Clause
// The library's exceptions as Python's, with the library's sentences.
#pragma once

#include <pybind11/pybind11.h>

#include "delassus/error.hpp"
#include "delassus/timestepper.hpp"

namespace delassus::python {

namespace py = pybind11;

/// An exception of the library as a class of the package; it derives from the classes given.
template <typename Exception>
py::object bind_error(py::module_& module, const char* name, const char* doc, const py::object& bases) {
    py::object type = py::register_exception<Exception>(module, name, bases);
    type.attr("__doc__") = doc;
    type.attr("__module__") = "delassus";
    return type;
}

inline void bind_errors(py::module_& module) {
    const auto builtin = [](PyObject* type) { return py::reinterpret_borrow<py::object>(type); };
    const py::object error = bind_error<Error>(module, "Error",
                                               "Base of the exceptions of Delassus; its text is one "
                                               "sentence: what, where, what would be right.",
                                               builtin(PyExc_RuntimeError));
    // Python asks the translators in the opposite order: derived classes come after their base.
    bind_error<InputError>(module, "InputError", "A file, a value or a call is wrong.",
                           py::make_tuple(error, builtin(PyExc_ValueError)));
    bind_error<Unsupported>(module, "Unsupported", "The chosen solver cannot take the problem.", error);
    bind_error<PluginError>(module, "PluginError", "A plugin could not be loaded, or broke the rules of its border.",
                            error);
    bind_error<StepFailure>(module, "StepFailure", "A step cannot be taken; the simulation is as it was before it.",
                            error);
}

}  // namespace delassus::python
