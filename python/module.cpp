// SPDX-License-Identifier: BSD-3-Clause
// The extension module delassus._delassus. What users see is in delassus/__init__.py.
#include <pybind11/pybind11.h>

#include "delassus/version.hpp"
#include "derivatives.hpp"
#include "errors.hpp"
#include "problems.hpp"
#include "python_solvers.hpp"
#include "scenes.hpp"
#include "serving.hpp"
#include "solver_classes.hpp"
#include "solvers.hpp"
#include "support/standard_descriptors.hpp"
#include "system_runs.hpp"
#include "views.hpp"

PYBIND11_MODULE(_delassus, module) {
    delassus::open_standard_descriptors();
    module.doc() = "The border between Delassus and Python; use the package delassus.";
    module.attr("version") = DELASSUS_VERSION;
    delassus::python::bind_errors(module);
    delassus::python::bind_problems(module);
    delassus::python::bind_solvers(module);
    delassus::python::bind_derivatives(module);
    delassus::python::bind_solver_classes(module);
    delassus::python::bind_serving(module);
    delassus::use_python_solvers(std::make_unique<delassus::python::SolversHere>());
    delassus::python::bind_scenes(module);
    delassus::python::bind_system_runs(module);
    delassus::python::bind_views(module);
}
